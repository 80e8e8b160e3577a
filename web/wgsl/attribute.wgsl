// Translated from shaders/web/attribute.comp by tools/build_wgsl.py: do not edit.
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

@binding(0) @group(0) var<storage, read> the_blob_0 : array<u32>;

@binding(4) @group(0) var<storage, read_write> all_values_0 : array<u32>;

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

fn job_values_0() -> u32
{
    return push_0.value_words_0 * (job_place_0 - push_0.first_0);
}

fn element_of_0( c_0 : u32,  v_0 : u32) -> u32
{
    var at_0 : u32 = job_values_0() + push_0.base_0 + push_0.stride_0 * v_0;
    if((push_0.stride_0) > u32(2))
    {
        return all_values_0[at_0 + c_0];
    }
    var first_1 : u32 = c_0 * push_0.field_0;
    var _S1 : u32 = (first_1 & (u32(31)));
    var value_0 : u32 = (all_values_0[at_0 + ((first_1 >> (u32(5))))] >> (_S1));
    var value_1 : u32;
    if((_S1 + push_0.field_0) > u32(32))
    {
        value_1 = (value_0 | (((all_values_0[at_0 + u32(1)] << ((u32(32) - _S1))))));
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

fn put_direction_0( at_1 : u32,  v_1 : u32,  bits_0 : u32)
{
    var scale_0 : f32 = 2.0f / f32(((u32(1) << (bits_0))) - u32(2));
    var x_0 : f32 = f32(element_of_0(u32(0), v_1)) * scale_0 - 1.0f;
    var y_0 : f32 = f32(element_of_0(u32(1), v_1)) * scale_0 - 1.0f;
    var z_0 : f32 = 1.0f - abs(x_0) - abs(y_0);
    var _S2 : f32 = max(- z_0, 0.0f);
    var _S3 : f32;
    if(x_0 < 0.0f)
    {
        _S3 = - _S2;
    }
    else
    {
        _S3 = _S2;
    }
    var x_1 : f32 = x_0 - _S3;
    if(y_0 < 0.0f)
    {
        _S3 = - _S2;
    }
    else
    {
        _S3 = _S2;
    }
    var y_1 : f32 = y_0 - _S3;
    var inverse_0 : f32 = 1.0f / sqrt(x_1 * x_1 + y_1 * y_1 + z_0 * z_0);
    results_0[at_1] = (bitcast<u32>((x_1 * inverse_0)));
    results_0[at_1 + u32(1)] = (bitcast<u32>((y_1 * inverse_0)));
    results_0[at_1 + u32(2)] = (bitcast<u32>((z_0 * inverse_0)));
    return;
}

fn grid_value_0( q_0 : u32,  step_0 : f32,  offset_0 : f32) -> f32
{
    return fma(f32(q_0), step_0, offset_0);
}

fn attribute_shader_0()
{
    var m_0 : u32 = push_0.first_0 + the_workgroup_0.x;
    var v_2 : u32 = the_thread_0;
    open_job_0(m_0);
    var summary_0 : u32 = atomicLoad(&(the_summaries_0[m_0]));
    var _S4 : bool;
    if(((summary_0 >> (u32(16)))) != u32(0))
    {
        _S4 = true;
    }
    else
    {
        _S4 = v_2 >= ((((summary_0 >> (u32(8)))) & (u32(127))));
    }
    if(_S4)
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
    var _S5 : u32 = (((shape_0 >> (u32(8)))) & (u32(255)));
    var vertex_0 : u32 = u32(64) * the_workgroup_0.x + v_2;
    if(kind_0 == u32(1))
    {
        put_direction_0(u32(3) * vertex_0, v_2, (((shape_0 >> (u32(16)))) & (u32(255))));
        return;
    }
    var c_1 : u32 = u32(0);
    for(;;)
    {
        if(c_1 < _S5)
        {
        }
        else
        {
            break;
        }
        var q_1 : u32 = element_of_0(c_1, v_2);
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
        results_0[_S5 * vertex_0 + c_1] = word_0;
        c_1 = c_1 + u32(1);
    }
    return;
}

@compute
@workgroup_size(64, 1, 1)
fn attribute_main(@builtin(local_invocation_index) thread_0 : u32, @builtin(workgroup_id) workgroup_0 : vec3<u32>, @builtin(global_invocation_id) invocation_0 : vec3<u32>)
{
    the_thread_0 = thread_0;
    the_workgroup_0 = workgroup_0;
    the_invocation_0 = invocation_0;
    attribute_shader_0();
    return;
}

