// Translated from shaders/decoders/geo.comp by web/build_wgsl.py: do not edit.
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
@binding(0) @group(0) var<storage, read> the_blob_0 : array<u32>;

struct Connected_std430_0
{
    @align(8) boundary_0 : vec2<u32>,
    @align(8) starts_0 : vec2<u32>,
    @align(8) closing_0 : vec2<u32>,
    @align(8) ends_0 : vec2<u32>,
    @align(8) splits_0 : vec2<u32>,
    @align(8) references_0 : vec2<u32>,
};

@binding(5) @group(0) var<storage, read_write> connectivity_0 : array<Connected_std430_0>;

@binding(2) @group(0) var<storage, read_write> the_summaries_0 : array<atomic<u32>>;

struct Places_std430_0
{
    @align(8) foreign_refs_0 : vec2<u32>,
    @align(8) private_refs_0 : vec2<u32>,
    @align(8) loop_ends_0 : vec2<u32>,
    @align(8) counts_0 : u32,
    @align(4) lengths_0 : u32,
    @align(8) entries_0 : u32,
    @align(4) codes_0 : u32,
    @align(8) anchors_0 : u32,
    @align(4) chains_0 : u32,
    @align(8) quotients_0 : u32,
    @align(4) interior_0 : u32,
    @align(8) waiting_0 : vec2<u32>,
};

@binding(6) @group(0) var<storage, read_write> all_places_0 : array<Places_std430_0>;

@binding(3) @group(0) var<storage, read_write> all_triangles_0 : array<u32>;

@binding(4) @group(0) var<storage, read_write> all_values_0 : array<u32>;

fn firstbithigh_0( value_0 : u32) -> u32
{
    var _S1 : u32 = firstLeadingBit(value_0);
    return _S1;
}

var<private> _S2 : u32;

var<private> member_0 : u32;

var<private> part_0 : u32;

var<private> _S3 : vec3<u32>;

var<private> job_meshlet_0 : u32;

var<private> job_place_0 : u32;

fn open_job_0( i_0 : u32)
{
    job_meshlet_0 = i_0;
    job_place_0 = i_0;
    return;
}

fn job_streams_0() -> u32
{
    return push_0.streams_0;
}

fn load_memory_0( i_1 : u32) -> u32
{
    return the_blob_0[min(i_1, push_0.blob_words_0 - u32(1))];
}

fn load_word_0( i_2 : u32) -> u32
{
    return load_memory_0(i_2);
}

var<private> stream_total_0 : u32;

var<private> meshlet_total_0 : u32;

var<private> byte_length_0 : u32;

var<private> group_table_0 : u32;

fn load_tables_0()
{
    var _S4 : u32 = ((((load_word_0(u32(1))) >> (u32(8)))) & (u32(255)));
    stream_total_0 = _S4;
    meshlet_total_0 = load_word_0(u32(4));
    byte_length_0 = load_word_0(u32(5));
    group_table_0 = u32(8) + u32(7) * _S4;
    return;
}

var<private> stream_end_0 : u32;

var<workgroup> group_stream_0 : array<u32, i32(8)>;

var<workgroup> group_bases_0 : array<u32, i32(8)>;

fn group_streams_0( end_0 : u32)
{
    load_tables_0();
    var _S5 : u32 = min(stream_total_0, u32(8));
    stream_total_0 = _S5;
    stream_end_0 = min(end_0, _S5);
    var s_0 : u32 = _S2;
    for(;;)
    {
        if(s_0 < stream_total_0)
        {
        }
        else
        {
            break;
        }
        var _S6 : u32 = u32(7) * s_0;
        var shape_0 : u32 = load_word_0(u32(8) + _S6);
        var before_0 : u32 = u32(0);
        var element_0 : u32 = u32(0);
        for(;;)
        {
            if(before_0 < s_0)
            {
            }
            else
            {
                break;
            }
            var element_1 : u32 = element_0 + (((((load_word_0(u32(8) + u32(7) * before_0)) >> (u32(8)))) & (u32(7))));
            before_0 = before_0 + u32(1);
            element_0 = element_1;
        }
        group_stream_0[s_0] = (((((((((shape_0 >> (u32(8)))) & (u32(7)))) | (((((((shape_0 >> (u32(16)))) & (u32(63)))) << (u32(3))))))) | (((((((shape_0 >> (u32(24)))) & (u32(7)))) << (u32(9))))))) | ((((min(element_0, u32(20))) << (u32(12))))));
        group_bases_0[s_0] = load_word_0(u32(9) + _S6);
        s_0 = s_0 + u32(64);
    }
    workgroupBarrier();
    return;
}

fn field_of_0( s_1 : u32) -> u32
{
    var bits_0 : u32 = (extractBits((group_stream_0[s_1]), u32((i32(3))), u32((i32(6)))));
    var field_1 : u32;
    if(s_1 == u32(0))
    {
        field_1 = max(bits_0, u32(21));
    }
    else
    {
        field_1 = bits_0;
    }
    var _S7 : u32 = (extractBits((group_stream_0[s_1]), u32((i32(0))), u32((i32(3)))));
    if((field_1 * _S7) <= u32(64))
    {
    }
    else
    {
        field_1 = u32(32);
    }
    return field_1;
}

fn words_of_0( s_2 : u32) -> u32
{
    var _S8 : u32 = field_of_0(s_2);
    var _S9 : u32 = (extractBits((group_stream_0[s_2]), u32((i32(0))), u32((i32(3)))));
    return ((_S8 * _S9 + u32(31)) >> (u32(5)));
}

var<workgroup> group_places_0 : array<u32, i32(8)>;

fn group_value_places_0()
{
    var s_3 : u32 = _S2;
    for(;;)
    {
        if(s_3 < stream_total_0)
        {
        }
        else
        {
            break;
        }
        var before_1 : u32 = u32(0);
        var words_0 : u32 = u32(0);
        for(;;)
        {
            if(before_1 < s_3)
            {
            }
            else
            {
                break;
            }
            var _S10 : u32 = words_of_0(before_1);
            var words_1 : u32 = words_0 + _S10;
            before_1 = before_1 + u32(1);
            words_0 = words_1;
        }
        var _S11 : u32 = ((u32(64) * words_0) & (u32(65535)));
        var _S12 : u32 = words_of_0(s_3);
        var _S13 : u32 = (_S11 | (((_S12 << (u32(16))))));
        var _S14 : u32 = field_of_0(s_3);
        group_places_0[s_3] = (_S13 | (((_S14 << (u32(22))))));
        s_3 = s_3 + u32(64);
    }
    workgroupBarrier();
    return;
}

fn job_values_0() -> u32
{
    return push_0.value_words_0 * (job_place_0 - push_0.first_0);
}

var<private> the_values_0 : u32;

var<private> the_boundary_0 : vec2<u32>;

var<private> the_starts_0 : vec2<u32>;

var<private> the_references_0 : vec2<u32>;

var<private> symbol_c_0 : vec2<u32>;

var<private> symbol_e_0 : vec2<u32>;

var<private> symbol_s_0 : vec2<u32>;

var<private> error_0 : u32;

var<private> present_0 : bool;

fn open_pass_0() -> bool
{
    var _S15 : u32 = _S2 / u32(32);
    member_0 = _S15;
    part_0 = _S2 % u32(32);
    var number_0 : u32 = push_0.first_0 + _S3.x * u32(2) + _S15;
    open_job_0(min(number_0, push_0.meshlets_0 - u32(1)));
    group_streams_0(job_streams_0());
    group_value_places_0();
    the_values_0 = job_values_0();
    the_boundary_0 = connectivity_0[job_place_0].boundary_0;
    the_starts_0 = connectivity_0[job_place_0].starts_0;
    the_references_0 = connectivity_0[job_place_0].references_0;
    symbol_c_0 = connectivity_0[job_place_0].closing_0;
    symbol_e_0 = connectivity_0[job_place_0].ends_0;
    symbol_s_0 = connectivity_0[job_place_0].splits_0;
    error_0 = u32(0);
    var summary_0 : u32 = atomicLoad(&(the_summaries_0[job_place_0]));
    var _S16 : bool;
    if(member_0 < u32(2))
    {
        _S16 = number_0 < (push_0.meshlets_0);
    }
    else
    {
        _S16 = false;
    }
    present_0 = _S16;
    if(_S16)
    {
        _S16 = ((summary_0 >> (u32(16)))) == u32(0);
    }
    else
    {
        _S16 = false;
    }
    return _S16;
}

fn mask_none_0() -> vec2<u32>
{
    return vec2<u32>(u32(0));
}

fn word_below_0( n_0 : u32) -> u32
{
    var _S17 : u32;
    if(n_0 >= u32(32))
    {
        _S17 = u32(4294967295);
    }
    else
    {
        _S17 = ((u32(1) << (n_0))) - u32(1);
    }
    return _S17;
}

fn mask_below_0( n_1 : u32) -> vec2<u32>
{
    var _S18 : u32 = word_below_0(n_1);
    var _S19 : u32;
    if(n_1 <= u32(32))
    {
        _S19 = u32(0);
    }
    else
    {
        _S19 = word_below_0(n_1 - u32(32));
    }
    return vec2<u32>(_S18, _S19);
}

var<workgroup> group_normals_0 : array<array<atomic<u32>, i32(192)>, i32(2)>;

fn job_triangles_0() -> u32
{
    return u32(64) * job_place_0;
}

fn excess_0( x_0 : u32,  y_0 : u32) -> u32
{
    var _S20 : u32;
    if(x_0 > y_0)
    {
        _S20 = x_0 - y_0;
    }
    else
    {
        _S20 = u32(0);
    }
    return _S20;
}

fn geo_shift_0() -> u32
{
    var _S21 : u32 = (extractBits((group_stream_0[u32(0)]), u32((i32(3))), u32((i32(6)))));
    return excess_0(_S21, u32(13));
}

fn word_of_0( s_4 : u32,  id_0 : u32) -> u32
{
    var _S22 : u32 = (extractBits((group_places_0[s_4]), u32((i32(0))), u32((i32(16)))));
    var _S23 : u32 = (extractBits((group_places_0[s_4]), u32((i32(16))), u32((i32(6)))));
    return _S22 + _S23 * ((id_0 & (u32(63))));
}

fn is_packed_0( s_5 : u32) -> bool
{
    var _S24 : u32 = (extractBits((group_places_0[s_5]), u32((i32(16))), u32((i32(6)))));
    return _S24 <= u32(2);
}

struct Triple_0
{
     x_1 : u32,
     y_1 : u32,
     z_0 : u32,
};

fn Triple_x24init_0( x_2 : u32,  y_2 : u32,  z_1 : u32) -> Triple_0
{
    var _S25 : Triple_0;
    _S25.x_1 = x_2;
    _S25.y_1 = y_2;
    _S25.z_0 = z_1;
    return _S25;
}

fn grid_position_0( id_1 : u32) -> Triple_0
{
    var word_0 : u32 = word_of_0(u32(0), id_1);
    var _S26 : bool = is_packed_0(u32(0));
    if(!_S26)
    {
        return Triple_x24init_0(all_values_0[the_values_0 + word_0], all_values_0[the_values_0 + (word_0 + u32(1))], all_values_0[the_values_0 + (word_0 + u32(2))]);
    }
    var _S27 : u32 = u32(2) * ((word_0 >> (u32(1))));
    return Triple_x24init_0((all_values_0[the_values_0 + _S27] & (u32(2097151))), (((((all_values_0[the_values_0 + _S27] >> (u32(21)))) | (((all_values_0[the_values_0 + _S27 + u32(1)] << (u32(11))))))) & (u32(2097151))), (((all_values_0[the_values_0 + _S27 + u32(1)] >> (u32(10)))) & (u32(2097151))));
}

fn shift_right_0( x_3 : u32,  n_2 : u32) -> u32
{
    return u32((i32(x_3) >> (n_2)));
}

fn shifted_0( v_0 : Triple_0,  n_3 : u32) -> Triple_0
{
    var _S28 : Triple_0 = v_0;
    _S28.x_1 = shift_right_0(_S28.x_1, n_3);
    _S28.y_1 = shift_right_0(_S28.y_1, n_3);
    _S28.z_0 = shift_right_0(_S28.z_0, n_3);
    return _S28;
}

fn difference_0( to_0 : Triple_0,  from_0 : Triple_0) -> Triple_0
{
    var _S29 : Triple_0 = to_0;
    _S29.x_1 = _S29.x_1 - from_0.x_1;
    _S29.y_1 = _S29.y_1 - from_0.y_1;
    _S29.z_0 = _S29.z_0 - from_0.z_0;
    return _S29;
}

fn triangle_normal_0( triangle_0 : u32,  h_0 : u32) -> Triple_0
{
    var _S30 : Triple_0 = grid_position_0((triangle_0 & (u32(63))));
    var a_0 : Triple_0 = shifted_0(_S30, h_0);
    var _S31 : Triple_0 = grid_position_0((((triangle_0 >> (u32(8)))) & (u32(63))));
    var e_0 : Triple_0 = difference_0(shifted_0(_S31, h_0), a_0);
    var _S32 : Triple_0 = grid_position_0((((triangle_0 >> (u32(16)))) & (u32(63))));
    var f_0 : Triple_0 = difference_0(shifted_0(_S32, h_0), a_0);
    var n_4 : Triple_0;
    n_4.x_1 = e_0.y_1 * f_0.z_0 - e_0.z_0 * f_0.y_1;
    n_4.y_1 = e_0.z_0 * f_0.x_1 - e_0.x_1 * f_0.z_0;
    n_4.z_0 = e_0.x_1 * f_0.y_1 - e_0.y_1 * f_0.x_1;
    return n_4;
}

fn mask_test_0( m_0 : vec2<u32>,  i_3 : u32) -> bool
{
    var _S33 : u32;
    if(((i_3 & (u32(32)))) == u32(0))
    {
        _S33 = m_0.x;
    }
    else
    {
        _S33 = m_0.y;
    }
    return ((((_S33 >> (((i_3 & (u32(31))))))) & (u32(1)))) != u32(0);
}

fn add_triangle_0( triangle_1 : u32,  wanted_0 : vec2<u32>)
{
    var _S34 : u32 = geo_shift_0();
    var _S35 : Triple_0 = triangle_normal_0(triangle_1, _S34);
    var corner_0 : u32 = u32(0);
    for(;;)
    {
        if(corner_0 < u32(3))
        {
        }
        else
        {
            break;
        }
        var id_2 : u32 = (((triangle_1 >> ((u32(8) * corner_0)))) & (u32(63)));
        if(!mask_test_0(wanted_0, id_2))
        {
            corner_0 = corner_0 + u32(1);
            continue;
        }
        var place_0 : u32 = u32(3) * id_2;
        var _S36 : u32 = atomicAdd(&(group_normals_0[member_0][place_0]), _S35.x_1);
        var _S37 : u32 = atomicAdd(&(group_normals_0[member_0][place_0 + u32(1)]), _S35.y_1);
        var _S38 : u32 = atomicAdd(&(group_normals_0[member_0][place_0 + u32(2)]), _S35.z_0);
        corner_0 = corner_0 + u32(1);
    }
    return;
}

fn mask_count_0( m_1 : vec2<u32>) -> u32
{
    return countOneBits(m_1.x) + countOneBits(m_1.y);
}

fn nth_bit_0( m_2 : vec2<u32>,  n_5 : u32) -> u32
{
    var _S39 : u32 = m_2.x;
    var low_0 : u32 = countOneBits(_S39);
    var _S40 : bool = n_5 < low_0;
    var half_width_0 : u32;
    if(_S40)
    {
        half_width_0 = u32(0);
    }
    else
    {
        half_width_0 = u32(32);
    }
    var word_1 : u32;
    if(_S40)
    {
        word_1 = _S39;
    }
    else
    {
        word_1 = m_2.y;
    }
    var _S41 : u32;
    if(n_5 >= low_0)
    {
        _S41 = n_5 - low_0;
    }
    else
    {
        _S41 = n_5;
    }
    var _S42 : u32 = half_width_0;
    half_width_0 = u32(16);
    var at_0 : u32 = _S42;
    for(;;)
    {
        if(half_width_0 > u32(0))
        {
        }
        else
        {
            break;
        }
        var ones_0 : u32 = countOneBits((word_1 & ((word_below_0(half_width_0)))));
        if(_S41 >= ones_0)
        {
            var _S43 : u32 = _S41 - ones_0;
            var at_1 : u32 = at_0 + half_width_0;
            word_1 = (word_1 >> (half_width_0));
            _S41 = _S43;
            at_0 = at_1;
        }
        half_width_0 = (half_width_0 >> (u32(1)));
    }
    return min(at_0, u32(63));
}

fn magnitude_0( x_4 : u32) -> u32
{
    var _S44 : u32;
    if(i32(x_4) < i32(0))
    {
        _S44 = u32(0) - x_4;
    }
    else
    {
        _S44 = x_4;
    }
    return _S44;
}

fn magnitudes_0( v_1 : Triple_0) -> u32
{
    return ((((magnitude_0(v_1.x_1)) | ((magnitude_0(v_1.y_1))))) | ((magnitude_0(v_1.z_0))));
}

fn bit_length_0( x_5 : u32) -> u32
{
    return firstbithigh_0(x_5) + u32(1);
}

struct OctPair_0
{
     u_0 : u32,
     v_2 : u32,
};

fn octahedral_prediction_0( normal_x_0 : u32,  normal_y_0 : u32,  normal_z_0 : u32,  bits_1 : u32) -> OctPair_0
{
    var n_6 : Triple_0;
    n_6.x_1 = normal_x_0;
    n_6.y_1 = normal_y_0;
    n_6.z_0 = normal_z_0;
    var k_0 : u32 = excess_0(bit_length_0(magnitudes_0(n_6)), u32(13));
    var limit_0 : u32 = ((u32(1) << (bits_1))) - u32(2);
    var x_6 : u32 = ((magnitude_0(normal_x_0)) >> (k_0));
    var y_3 : u32 = ((magnitude_0(normal_y_0)) >> (k_0));
    var sum_0 : u32 = x_6 + y_3 + (((magnitude_0(normal_z_0)) >> (k_0)));
    var q_0 : OctPair_0;
    var _S45 : u32 = (limit_0 >> (u32(1)));
    q_0.u_0 = _S45;
    q_0.v_2 = _S45;
    if(sum_0 == u32(0))
    {
        return q_0;
    }
    var below_0 : bool = i32(n_6.z_0) < i32(0);
    var u_1 : u32;
    if(below_0)
    {
        u_1 = sum_0 - y_3;
    }
    else
    {
        u_1 = x_6;
    }
    var v_3 : u32;
    if(below_0)
    {
        v_3 = sum_0 - x_6;
    }
    else
    {
        v_3 = y_3;
    }
    if(i32(n_6.x_1) < i32(0))
    {
        u_1 = sum_0 - u_1;
    }
    else
    {
        u_1 = sum_0 + u_1;
    }
    if(i32(n_6.y_1) < i32(0))
    {
        v_3 = sum_0 - v_3;
    }
    else
    {
        v_3 = sum_0 + v_3;
    }
    var _S46 : u32 = u32(2) * sum_0;
    var _S47 : u32 = (u_1 * limit_0 + sum_0) / _S46;
    q_0.u_0 = _S47;
    var _S48 : u32 = (v_3 * limit_0 + sum_0) / _S46;
    q_0.v_2 = _S48;
    return q_0;
}

fn vertex_at_0( s_6 : u32,  id_3 : u32) -> vec2<u32>
{
    var word_2 : u32 = word_of_0(s_6, id_3);
    var _S49 : u32 = (extractBits((group_places_0[s_6]), u32((i32(16))), u32((i32(6)))));
    if(_S49 == u32(1))
    {
        return vec2<u32>(all_values_0[the_values_0 + word_2], u32(0));
    }
    var _S50 : u32 = u32(2) * ((word_2 >> (u32(1))));
    return vec2<u32>(all_values_0[the_values_0 + _S50], all_values_0[the_values_0 + _S50 + u32(1)]);
}

fn get_field_0( fields_0 : vec2<u32>,  at_2 : u32,  bits_2 : u32) -> u32
{
    var value_1 : u32;
    if(at_2 < u32(32))
    {
        value_1 = ((((fields_0.x) >> (at_2))) | ((((((fields_0.y) << (u32(1)))) << ((u32(31) - at_2))))));
    }
    else
    {
        value_1 = ((fields_0.y) >> ((at_2 - u32(32))));
    }
    return (value_1 & ((word_below_0(bits_2))));
}

fn bits_mask_0( s_7 : u32) -> u32
{
    var _S51 : u32 = (extractBits((group_stream_0[s_7]), u32((i32(3))), u32((i32(6)))));
    return word_below_0(_S51);
}

fn put_field_0( at_3 : u32,  value_2 : u32) -> vec2<u32>
{
    var _S52 : vec2<u32>;
    if(at_3 < u32(32))
    {
        _S52 = vec2<u32>((value_2 << (at_3)), (((value_2 >> (u32(1)))) >> ((u32(31) - at_3))));
    }
    else
    {
        _S52 = vec2<u32>(u32(0), (value_2 << ((at_3 - u32(32)))));
    }
    return _S52;
}

fn put_vertex_0( s_8 : u32,  id_4 : u32,  fields_1 : vec2<u32>)
{
    var word_3 : u32 = word_of_0(s_8, id_4);
    var _S53 : u32 = (extractBits((group_places_0[s_8]), u32((i32(16))), u32((i32(6)))));
    if(_S53 == u32(1))
    {
        all_values_0[the_values_0 + word_3] = fields_1.x;
    }
    else
    {
        var _S54 : u32 = u32(2) * ((word_3 >> (u32(1))));
        all_values_0[the_values_0 + _S54] = fields_1.x;
        all_values_0[the_values_0 + _S54 + u32(1)] = fields_1.y;
    }
    return;
}

fn add_prediction_0( s_9 : u32,  id_5 : u32)
{
    var _S55 : u32 = u32(3) * id_5;
    var _S56 : u32 = atomicLoad(&(group_normals_0[member_0][_S55]));
    var _S57 : u32 = atomicLoad(&(group_normals_0[member_0][_S55 + u32(1)]));
    var _S58 : u32 = atomicLoad(&(group_normals_0[member_0][_S55 + u32(2)]));
    var _S59 : u32 = (extractBits((group_stream_0[s_9]), u32((i32(3))), u32((i32(6)))));
    var point_0 : OctPair_0 = octahedral_prediction_0(_S56, _S57, _S58, (_S59 & (u32(31))));
    var field_2 : u32 = (extractBits((group_places_0[s_9]), u32((i32(22))), u32((i32(6)))));
    var residuals_0 : vec2<u32> = vertex_at_0(s_9, id_5);
    var _S60 : u32 = point_0.u_0 + get_field_0(residuals_0, u32(0), field_2);
    var _S61 : u32 = bits_mask_0(s_9);
    var u_2 : u32 = (_S60 & (_S61));
    var _S62 : u32 = point_0.v_2 + get_field_0(residuals_0, field_2, field_2);
    var _S63 : u32 = bits_mask_0(s_9);
    put_vertex_0(s_9, id_5, ((put_field_0(u32(0), u_2)) | ((put_field_0(field_2, (_S62 & (_S63)))))));
    return;
}

@compute
@workgroup_size(64, 1, 1)
fn main(@builtin(local_invocation_index) gl_LocalInvocationIndex_0 : u32, @builtin(workgroup_id) gl_WorkGroupID_0 : vec3<u32>)
{
    _S2 = gl_LocalInvocationIndex_0;
    _S3 = gl_WorkGroupID_0;
    var live_0 : bool = open_pass_0();
    var summary_1 : u32 = atomicLoad(&(the_summaries_0[job_place_0]));
    var s_10 : u32;
    if(live_0)
    {
        s_10 = min((summary_1 & (u32(127))), u32(64));
    }
    else
    {
        s_10 = u32(0);
    }
    var _S64 : vec2<u32> = mask_none_0();
    var wanted_1 : vec2<u32>;
    if(live_0)
    {
        wanted_1 = ((mask_below_0((((summary_1 >> (u32(8)))) & (u32(127))))) & ((~((the_boundary_0 & ((~all_places_0[job_place_0].waiting_0)))))));
    }
    else
    {
        wanted_1 = _S64;
    }
    var i_4 : u32 = part_0;
    for(;;)
    {
        if(i_4 < u32(192))
        {
        }
        else
        {
            break;
        }
        atomicStore(&(group_normals_0[member_0][i_4]), u32(0));
        i_4 = i_4 + u32(32);
    }
    workgroupBarrier();
    var t_0 : u32 = part_0;
    for(;;)
    {
        if(t_0 < s_10)
        {
        }
        else
        {
            break;
        }
        add_triangle_0(all_triangles_0[job_triangles_0() + t_0], wanted_1);
        t_0 = t_0 + u32(32);
    }
    workgroupBarrier();
    i_4 = part_0;
    for(;;)
    {
        if(i_4 < (mask_count_0(wanted_1)))
        {
        }
        else
        {
            break;
        }
        var _S65 : u32 = nth_bit_0(wanted_1, i_4);
        s_10 = u32(1);
        for(;;)
        {
            if(s_10 < stream_end_0)
            {
            }
            else
            {
                break;
            }
            var _S66 : u32 = (extractBits((group_stream_0[s_10]), u32((i32(9))), u32((i32(3)))));
            if(_S66 == u32(4))
            {
                add_prediction_0(s_10, _S65);
            }
            s_10 = s_10 + u32(1);
        }
        i_4 = i_4 + u32(32);
    }
    return;
}

