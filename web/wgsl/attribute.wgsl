// Translated from shaders/web/attribute.comp by web/build_wgsl.py: do not edit.
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

@binding(0) @group(0) var<storage, read> the_blob_0 : array<u32>;

@binding(4) @group(0) var<storage, read_write> all_values_0 : array<u32>;

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

fn job_values_0() -> u32
{
    return push_0.value_words_0 * (job_place_0 - push_0.first_0);
}

fn element_of_0( c_0 : u32,  v_0 : u32) -> u32
{
    var at_0 : u32 = job_values_0() + push_0.base_0;
    if((push_0.field_0) == u32(0))
    {
        return all_values_0[at_0 + (u32(64) * c_0 + v_0)];
    }
    var at_1 : u32 = at_0 + push_0.stride_0 * v_0;
    if((push_0.stride_0) > u32(2))
    {
        return all_values_0[at_1 + c_0];
    }
    var first_1 : u32 = c_0 * push_0.field_0;
    var _S3 : u32 = (first_1 & (u32(31)));
    var value_0 : u32 = (all_values_0[at_1 + ((first_1 >> (u32(5))))] >> (_S3));
    var value_1 : u32;
    if((_S3 + push_0.field_0) > u32(32))
    {
        value_1 = (value_0 | (((all_values_0[at_1 + u32(1)] << ((u32(32) - _S3))))));
    }
    else
    {
        value_1 = value_0;
    }
    if((push_0.field_0) == u32(32))
    {
    }
    else
    {
        value_1 = (value_1 & ((((u32(1) << ((push_0.field_0)))) - u32(1))));
    }
    return value_1;
}

fn put_direction_0( at_2 : u32,  v_1 : u32,  bits_0 : u32)
{
    var scale_0 : f32 = 2.0f / f32(((u32(1) << (bits_0))) - u32(2));
    var x_0 : f32 = f32(element_of_0(u32(0), v_1)) * scale_0 - 1.0f;
    var y_0 : f32 = f32(element_of_0(u32(1), v_1)) * scale_0 - 1.0f;
    var z_0 : f32 = 1.0f - abs(x_0) - abs(y_0);
    var _S4 : f32 = max(- z_0, 0.0f);
    var _S5 : f32;
    if(x_0 < 0.0f)
    {
        _S5 = - _S4;
    }
    else
    {
        _S5 = _S4;
    }
    var x_1 : f32 = x_0 - _S5;
    if(y_0 < 0.0f)
    {
        _S5 = - _S4;
    }
    else
    {
        _S5 = _S4;
    }
    var y_1 : f32 = y_0 - _S5;
    var inverse_0 : f32 = 1.0f / sqrt(x_1 * x_1 + y_1 * y_1 + z_0 * z_0);
    results_0[at_2] = (bitcast<u32>((x_1 * inverse_0)));
    results_0[at_2 + u32(1)] = (bitcast<u32>((y_1 * inverse_0)));
    results_0[at_2 + u32(2)] = (bitcast<u32>((z_0 * inverse_0)));
    return;
}

fn grid_value_0( q_0 : u32,  step_0 : f32,  offset_0 : f32) -> f32
{
    return fma(f32(q_0), step_0, offset_0);
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
    var _S6 : bool;
    if(((summary_0 >> (u32(16)))) != u32(0))
    {
        _S6 = true;
    }
    else
    {
        _S6 = gl_LocalInvocationIndex_0 >= ((((summary_0 >> (u32(8)))) & (u32(127))));
    }
    if(_S6)
    {
        return;
    }
    var row_0 : u32 = u32(8) + u32(7) * push_0.stream_0;
    var shape_0 : u32 = the_blob_0[row_0];
    var kind_0 : u32;
    if((push_0.integers_0) != u32(0))
    {
        kind_0 = u32(2);
    }
    else
    {
        kind_0 = (shape_0 & (u32(255)));
    }
    var _S7 : u32 = (((shape_0 >> (u32(8)))) & (u32(255)));
    var vertex_0 : u32 = u32(64) * _S1.x + gl_LocalInvocationIndex_0;
    if(kind_0 == u32(1))
    {
        put_direction_0(u32(3) * vertex_0, gl_LocalInvocationIndex_0, (((shape_0 >> (u32(16)))) & (u32(255))));
        return;
    }
    var c_1 : u32 = u32(0);
    for(;;)
    {
        if(c_1 < _S7)
        {
        }
        else
        {
            break;
        }
        var q_1 : u32 = element_of_0(c_1, gl_LocalInvocationIndex_0);
        var word_0 : u32;
        if(kind_0 == u32(3))
        {
            if(((q_1 & (u32(2147483648)))) != u32(0))
            {
                word_0 = (q_1 ^ (u32(2147483648)));
            }
            else
            {
                word_0 = ~q_1;
            }
        }
        else
        {
            if(kind_0 == u32(4))
            {
                word_0 = (bitcast<u32>((2.0f * f32(q_1) - 1.0f)));
            }
            else
            {
                if(kind_0 == u32(0))
                {
                    word_0 = (bitcast<u32>((grid_value_0(q_1, (bitcast<f32>((the_blob_0[row_0 + u32(2)]))), (bitcast<f32>((the_blob_0[row_0 + u32(3) + c_1])))))));
                }
                else
                {
                    word_0 = q_1;
                }
            }
        }
        results_0[_S7 * vertex_0 + c_1] = word_0;
        c_1 = c_1 + u32(1);
    }
    return;
}

