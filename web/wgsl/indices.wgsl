// Translated from shaders/web/indices.comp by web/build_wgsl.py: do not edit.
struct Push_std140_0
{
    @align(16) blob_words_0 : u32,
    @align(4) meshlets_0 : u32,
    @align(8) streams_0 : u32,
    @align(4) value_words_0 : u32,
    @align(16) first_0 : u32,
    @align(4) stream_0 : u32,
    @align(8) base_0 : u32,
    @align(4) stride_0 : u32,
    @align(16) field_0 : u32,
    @align(4) integers_0 : u32,
};

@binding(1) @group(0) var<uniform> push_0 : Push_std140_0;
@binding(2) @group(0) var<storage, read_write> the_summaries_0 : array<atomic<u32>>;

@binding(3) @group(0) var<storage, read_write> all_triangles_0 : array<u32>;

@binding(7) @group(0) var<storage, read_write> first_triangles_0 : array<u32>;

@binding(10) @group(0) var<storage, read_write> results_0 : array<u32>;

var<private> _S1 : vec3<u32>;

var<private> _S2 : u32;

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

@compute
@workgroup_size(64, 1, 1)
fn main(@builtin(workgroup_id) gl_WorkGroupID_0 : vec3<u32>, @builtin(local_invocation_index) gl_LocalInvocationIndex_0 : u32)
{
    _S1 = gl_WorkGroupID_0;
    _S2 = gl_LocalInvocationIndex_0;
    var m_0 : u32 = push_0.first_0 + gl_WorkGroupID_0.x;
    open_job_0(m_0);
    var summary_0 : u32 = atomicLoad(&(the_summaries_0[m_0]));
    var _S3 : bool;
    if(((summary_0 >> (u32(16)))) != u32(0))
    {
        _S3 = true;
    }
    else
    {
        _S3 = gl_LocalInvocationIndex_0 >= ((summary_0 & (u32(127))));
    }
    if(_S3)
    {
        return;
    }
    var _S4 : u32 = all_triangles_0[job_triangles_0() + gl_LocalInvocationIndex_0];
    var _S5 : u32 = u32(3) * (first_triangles_0[m_0] + gl_LocalInvocationIndex_0);
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
        results_0[_S5 + c_0] = u32(64) * m_0 + ((((_S4 >> ((u32(8) * c_0)))) & (u32(63))));
        c_0 = c_0 + u32(1);
    }
    return;
}

