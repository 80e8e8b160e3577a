// Translated from shaders/web/ranges.comp by tools/build_wgsl.py: do not edit.
struct Push_std140_0
{
    @align(16) blob_words_0 : u32,
    @align(4) meshlets_0 : u32,
    @align(8) streams_0 : u32,
    @align(4) value_words_0 : u32,
    @align(16) spread_0 : u32,
    @align(4) first_0 : u32,
    @align(8) stream_0 : u32,
    @align(4) base_0 : u32,
    @align(16) stride_0 : u32,
    @align(4) field_0 : u32,
    @align(8) integers_0 : u32,
};

@binding(1) @group(0) var<uniform> push_0 : Push_std140_0;
@binding(2) @group(0) var<storage, read_write> the_summaries_0 : array<atomic<u32>>;

@binding(7) @group(0) var<storage, read_write> first_triangles_0 : array<u32>;

@binding(8) @group(0) var<storage, read_write> draw_0 : array<u32>;

@binding(9) @group(0) var<storage, read_write> status_0 : array<u32>;

var<private> the_thread_0 : u32;

var<private> the_workgroup_0 : vec3<u32>;

var<private> the_invocation_0 : vec3<u32>;

var<workgroup> shared_triangles_0 : array<u32, i32(256)>;

var<workgroup> shared_malformed_0 : array<u32, i32(256)>;

var<workgroup> shared_first_0 : array<u32, i32(256)>;

fn ranges_shader_0()
{
    var share_0 : u32 = (push_0.meshlets_0 + u32(256) - u32(1)) / u32(256);
    var _S1 : u32 = min(the_thread_0 * share_0, push_0.meshlets_0);
    var _S2 : u32 = min(_S1 + share_0, push_0.meshlets_0);
    var first_1 : u32 = u32(4294967295);
    var m_0 : u32 = _S1;
    var triangles_0 : u32 = u32(0);
    var malformed_0 : u32 = u32(0);
    for(;;)
    {
        if(m_0 < _S2)
        {
        }
        else
        {
            break;
        }
        var summary_0 : u32 = atomicLoad(&(the_summaries_0[m_0]));
        first_triangles_0[m_0] = triangles_0;
        if(((summary_0 >> (u32(16)))) == u32(0))
        {
            triangles_0 = triangles_0 + ((summary_0 & (u32(127))));
        }
        else
        {
            var _S3 : u32 = malformed_0 + u32(1);
            first_1 = min(first_1, m_0);
            malformed_0 = _S3;
        }
        m_0 = m_0 + u32(1);
    }
    shared_triangles_0[the_thread_0] = triangles_0;
    shared_malformed_0[the_thread_0] = malformed_0;
    shared_first_0[the_thread_0] = first_1;
    workgroupBarrier();
    var i_0 : u32 = u32(0);
    var place_0 : u32 = u32(0);
    for(;;)
    {
        if(i_0 < the_thread_0)
        {
        }
        else
        {
            break;
        }
        var place_1 : u32 = place_0 + shared_triangles_0[i_0];
        i_0 = i_0 + u32(1);
        place_0 = place_1;
    }
    m_0 = _S1;
    for(;;)
    {
        if(m_0 < _S2)
        {
        }
        else
        {
            break;
        }
        first_triangles_0[m_0] = first_triangles_0[m_0] + place_0;
        m_0 = m_0 + u32(1);
    }
    if(the_thread_0 != u32(255))
    {
        return;
    }
    i_0 = u32(0);
    for(;;)
    {
        if(i_0 < u32(255))
        {
        }
        else
        {
            break;
        }
        var malformed_1 : u32 = malformed_0 + shared_malformed_0[i_0];
        var _S4 : u32 = min(first_1, shared_first_0[i_0]);
        var _S5 : u32 = i_0 + u32(1);
        first_1 = _S4;
        i_0 = _S5;
        malformed_0 = malformed_1;
    }
    draw_0[i32(0)] = u32(3) * (place_0 + triangles_0);
    draw_0[i32(1)] = u32(1);
    draw_0[i32(2)] = u32(0);
    draw_0[i32(3)] = u32(0);
    draw_0[i32(4)] = u32(0);
    status_0[i32(0)] = malformed_0;
    status_0[i32(1)] = first_1;
    return;
}

@compute
@workgroup_size(256, 1, 1)
fn ranges_main(@builtin(local_invocation_index) thread_0 : u32, @builtin(workgroup_id) workgroup_0 : vec3<u32>, @builtin(global_invocation_id) invocation_0 : vec3<u32>)
{
    the_thread_0 = thread_0;
    the_workgroup_0 = workgroup_0;
    the_invocation_0 = invocation_0;
    ranges_shader_0();
    return;
}

