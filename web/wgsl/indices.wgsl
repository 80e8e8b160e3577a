// Translated from shaders/web/indices.comp by tools/build_wgsl.py: do not edit.
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

@binding(3) @group(0) var<storage, read_write> all_triangles_0 : array<u32>;

@binding(7) @group(0) var<storage, read_write> first_triangles_0 : array<u32>;

@binding(10) @group(0) var<storage, read_write> results_0 : array<u32>;

var<private> the_thread_0 : u32;

var<private> the_workgroup_0 : vec3<u32>;

var<private> the_invocation_0 : vec3<u32>;

var<private> job_meshlet_0 : u32;

var<private> job_place_0 : u32;

fn open_job_0( i_0 : u32)
{
    job_meshlet_0 = i_0;
    job_place_0 = i_0;
    return;
}

fn job_triangles_0() -> u32
{
    return u32(64) * job_place_0;
}

fn indices_shader_0()
{
    var m_0 : u32 = push_0.first_0 + the_workgroup_0.x;
    var t_0 : u32 = the_thread_0;
    open_job_0(m_0);
    var summary_0 : u32 = atomicLoad(&(the_summaries_0[m_0]));
    var _S1 : bool;
    if(((summary_0 >> (u32(16)))) != u32(0))
    {
        _S1 = true;
    }
    else
    {
        _S1 = t_0 >= ((summary_0 & (u32(127))));
    }
    if(_S1)
    {
        return;
    }
    var _S2 : u32 = all_triangles_0[job_triangles_0() + t_0];
    var _S3 : u32 = u32(3) * (first_triangles_0[m_0] + t_0);
    var c_0 : u32 = u32(0);
    for(;;)
    {
        if(c_0 < u32(3))
        {
        }
        else
        {
            break;
        }
        results_0[_S3 + c_0] = u32(64) * m_0 + ((((_S2 >> ((u32(8) * c_0)))) & (u32(63))));
        c_0 = c_0 + u32(1);
    }
    return;
}

@compute
@workgroup_size(64, 1, 1)
fn indices_main(@builtin(local_invocation_index) thread_0 : u32, @builtin(workgroup_id) workgroup_0 : vec3<u32>, @builtin(global_invocation_id) invocation_0 : vec3<u32>)
{
    the_thread_0 = thread_0;
    the_workgroup_0 = workgroup_0;
    the_invocation_0 = invocation_0;
    indices_shader_0();
    return;
}

