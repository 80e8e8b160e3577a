// Translated from shaders/decoders/decode.comp by web/build_wgsl.py: do not edit.
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

@binding(3) @group(0) var<storage, read_write> all_triangles_0 : array<u32>;

@binding(4) @group(0) var<storage, read_write> all_values_0 : array<u32>;

@binding(2) @group(0) var<storage, read_write> the_summaries_0 : array<atomic<u32>>;

fn firstbithigh_0( value_0 : u32) -> u32
{
    var _S1 : u32 = firstLeadingBit(value_0);
    return _S1;
}

fn firstbitlow_0( value_1 : u32) -> u32
{
    var _S2 : u32 = firstTrailingBit(value_1);
    return _S2;
}

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

var<private> stream_first_0 : u32;

var<private> stream_end_0 : u32;

var<private> needs_positions_0 : bool;

var<private> needs_normals_0 : bool;

var<private> stream_elements_0 : array<u32, i32(64)>;

var<private> stream_bits_0 : array<u32, i32(64)>;

var<private> stream_mask_0 : array<u32, i32(64)>;

var<private> stream_predictor_0 : array<u32, i32(64)>;

var<private> stream_chain_base_0 : array<u32, i32(64)>;

var<private> stream_interior_base_0 : array<u32, i32(64)>;

var<private> stream_anchor_base_0 : array<u32, i32(64)>;

var<private> stream_element_0 : array<u32, i32(64)>;

fn is_decoded_0( s_0 : u32) -> bool
{
    var _S5 : bool;
    if(s_0 < stream_end_0)
    {
        if(s_0 >= stream_first_0)
        {
            _S5 = true;
        }
        else
        {
            if(s_0 == u32(0))
            {
                _S5 = needs_positions_0;
            }
            else
            {
                _S5 = false;
            }
        }
    }
    else
    {
        _S5 = false;
    }
    return _S5;
}

fn load_streams_0( first_1 : u32,  end_0 : u32)
{
    load_tables_0();
    stream_first_0 = first_1;
    stream_end_0 = end_0;
    needs_positions_0 = false;
    needs_normals_0 = false;
    var s_1 : u32 = first_1;
    for(;;)
    {
        if(s_1 < end_0)
        {
        }
        else
        {
            break;
        }
        var predictor_0 : u32 = ((load_word_0(u32(8) + u32(7) * s_1)) >> (u32(24)));
        var _S6 : bool;
        if(needs_positions_0)
        {
            _S6 = true;
        }
        else
        {
            _S6 = predictor_0 >= u32(4);
        }
        needs_positions_0 = _S6;
        var _S7 : bool;
        if(needs_normals_0)
        {
            _S7 = true;
        }
        else
        {
            _S7 = predictor_0 == u32(4);
        }
        needs_normals_0 = _S7;
        s_1 = s_1 + u32(1);
    }
    s_1 = u32(0);
    var element_0 : u32 = u32(0);
    for(;;)
    {
        if(s_1 < stream_total_0)
        {
        }
        else
        {
            break;
        }
        var _S8 : u32 = u32(7) * s_1;
        var shape_0 : u32 = load_word_0(u32(8) + _S8);
        var bases_0 : u32 = load_word_0(u32(9) + _S8);
        var bits_0 : u32 = (((shape_0 >> (u32(16)))) & (u32(255)));
        var _S9 : u32 = (((shape_0 >> (u32(8)))) & (u32(255)));
        stream_elements_0[s_1] = _S9;
        stream_bits_0[s_1] = bits_0;
        var _S10 : u32;
        if(bits_0 >= u32(32))
        {
            _S10 = u32(4294967295);
        }
        else
        {
            _S10 = ((u32(1) << (bits_0))) - u32(1);
        }
        stream_mask_0[s_1] = _S10;
        stream_predictor_0[s_1] = (shape_0 >> (u32(24)));
        stream_chain_base_0[s_1] = (bases_0 & (u32(255)));
        stream_interior_base_0[s_1] = (((bases_0 >> (u32(8)))) & (u32(255)));
        stream_anchor_base_0[s_1] = (((bases_0 >> (u32(16)))) & (u32(255)));
        stream_element_0[s_1] = element_0;
        if(is_decoded_0(s_1))
        {
            element_0 = element_0 + _S9;
        }
        s_1 = s_1 + u32(1);
    }
    return;
}

var<private> error_0 : u32;

fn word_below_0( n_0 : u32) -> u32
{
    var _S11 : u32;
    if(n_0 >= u32(32))
    {
        _S11 = u32(4294967295);
    }
    else
    {
        _S11 = ((u32(1) << (n_0))) - u32(1);
    }
    return _S11;
}

struct UnaryReader_0
{
     window_0 : u32,
     base_1 : u32,
     cursor_0 : u32,
};

fn UnaryReader_x24init_0( window_1 : u32,  base_2 : u32,  cursor_1 : u32) -> UnaryReader_0
{
    var _S12 : UnaryReader_0;
    _S12.window_0 = window_1;
    _S12.base_1 = base_2;
    _S12.cursor_0 = cursor_1;
    return _S12;
}

fn seek_unary_0( p_0 : u32) -> UnaryReader_0
{
    return UnaryReader_x24init_0(((load_word_0((p_0 >> (u32(5))))) & ((~word_below_0((p_0 & (u32(31))))))), (p_0 & (u32(4294967264))), p_0);
}

var<private> unary_0 : UnaryReader_0;

var<private> triangle_count_0 : u32;

var<private> vertex_count_0 : u32;

struct Header_0
{
     meshlet_0 : u32,
     triangles_0 : u32,
     references_0 : u32,
     flags_0 : u32,
     table_0 : u32,
     begin_0 : u32,
     lengths_0 : u32,
     entries_0 : u32,
     codes_0 : u32,
     length_width_0 : u32,
     delta_width_0 : u32,
     slot_width_0 : u32,
     entry_width_0 : u32,
     foreign_refs_0 : vec2<u32>,
     private_refs_0 : vec2<u32>,
     owned_refs_0 : vec2<u32>,
     sized_refs_0 : vec2<u32>,
     loop_ends_0 : vec2<u32>,
};

var<private> visited_0 : Header_0;

var<private> located_0 : u32;

fn load_words2_0( i_3 : u32) -> vec2<u32>
{
    return vec2<u32>(load_memory_0(i_3), load_memory_0(i_3 + u32(1)));
}

fn funnel_0( low_0 : u32,  high_0 : u32,  shift_0 : u32) -> u32
{
    return (((low_0 >> (shift_0))) | (((((high_0 << (u32(1)))) << ((u32(31) - shift_0))))));
}

fn load_bits_0( p_1 : u32,  n_1 : u32) -> u32
{
    var words_0 : vec2<u32> = load_words2_0((p_1 >> (u32(5))));
    return ((funnel_0(words_0.x, words_0.y, (p_1 & (u32(31))))) & ((word_below_0(n_1))));
}

fn meshlet_start_0( m_0 : u32) -> u32
{
    var group_0 : u32 = group_table_0 + u32(3) * (m_0 / u32(32));
    var base_3 : u32 = load_word_0(group_0);
    var line_0 : u32 = load_word_0(group_0 + u32(1));
    var width_0 : u32 = ((load_word_0(group_0 + u32(2))) & (u32(31)));
    var i_4 : u32 = m_0 % u32(32);
    var rest_0 : u32 = meshlet_total_0 - (m_0 - i_4);
    var count_0 : u32;
    if(rest_0 < u32(32))
    {
        count_0 = rest_0;
    }
    else
    {
        count_0 = u32(32);
    }
    return base_3 + (((count_0 * width_0 + u32(7)) >> (u32(3)))) + ((line_0 & (u32(65535)))) * i_4 - ((line_0 >> (u32(16)))) + load_bits_0(u32(8) * base_3 + i_4 * width_0, width_0);
}

fn load_words3_0( i_5 : u32) -> vec3<u32>
{
    return vec3<u32>(load_memory_0(i_5), load_memory_0(i_5 + u32(1)), load_memory_0(i_5 + u32(2)));
}

fn mask_below_0( n_2 : u32) -> vec2<u32>
{
    var _S13 : u32 = word_below_0(n_2);
    var _S14 : u32;
    if(n_2 <= u32(32))
    {
        _S14 = u32(0);
    }
    else
    {
        _S14 = word_below_0(n_2 - u32(32));
    }
    return vec2<u32>(_S13, _S14);
}

fn load_mask_0( p_2 : u32,  n_3 : u32) -> vec2<u32>
{
    var words_1 : vec3<u32> = load_words3_0((p_2 >> (u32(5))));
    var _S15 : u32 = words_1.y;
    var _S16 : u32 = (p_2 & (u32(31)));
    return (vec2<u32>(funnel_0(words_1.x, _S15, _S16), funnel_0(_S15, words_1.z, _S16)) & ((mask_below_0(n_3))));
}

fn mask_count_0( m_1 : vec2<u32>) -> u32
{
    return countOneBits(m_1.x) + countOneBits(m_1.y);
}

struct Planes_0
{
     p0_0 : vec2<u32>,
     p1_0 : vec2<u32>,
     p2_0 : vec2<u32>,
     p3_0 : vec2<u32>,
     end_1 : u32,
};

fn load_planes_0( begin_1 : u32,  triangles_1 : u32) -> Planes_0
{
    var count_1 : u32 = triangles_1 - u32(1);
    var planes_0 : Planes_0;
    var _S17 : vec2<u32> = load_mask_0(begin_1, count_1);
    planes_0.p0_0 = _S17;
    var p_3 : u32 = begin_1 + count_1;
    var count_2 : u32 = mask_count_0(_S17);
    var _S18 : vec2<u32> = load_mask_0(p_3, count_2);
    planes_0.p1_0 = _S18;
    var p_4 : u32 = p_3 + count_2;
    var count_3 : u32 = mask_count_0(_S18);
    var _S19 : vec2<u32> = load_mask_0(p_4, count_3);
    planes_0.p2_0 = _S19;
    var p_5 : u32 = p_4 + count_3;
    var count_4 : u32 = mask_count_0(_S19);
    planes_0.p3_0 = load_mask_0(p_5, count_4);
    planes_0.end_1 = p_5 + count_4;
    return planes_0;
}

fn mask_none_0() -> vec2<u32>
{
    return vec2<u32>(u32(0));
}

fn mask_bit_0( i_6 : u32) -> vec2<u32>
{
    var _S20 : vec2<u32>;
    if(((i_6 & (u32(32)))) == u32(0))
    {
        _S20 = vec2<u32>((u32(1) << (((i_6 & (u32(31)))))), u32(0));
    }
    else
    {
        _S20 = vec2<u32>(u32(0), (u32(1) << (((i_6 & (u32(31)))))));
    }
    return _S20;
}

fn mask_test_0( m_2 : vec2<u32>,  i_7 : u32) -> bool
{
    var _S21 : u32;
    if(((i_7 & (u32(32)))) == u32(0))
    {
        _S21 = m_2.x;
    }
    else
    {
        _S21 = m_2.y;
    }
    return ((((_S21 >> (((i_7 & (u32(31))))))) & (u32(1)))) != u32(0);
}

fn mask_any_0( m_3 : vec2<u32>) -> bool
{
    return (((m_3.x) | ((m_3.y)))) != u32(0);
}

fn mask_shl1_0( m_4 : vec2<u32>) -> vec2<u32>
{
    var _S22 : u32 = m_4.x;
    return vec2<u32>((_S22 << (u32(1))), ((((m_4.y) << (u32(1)))) | (((_S22 >> (u32(31)))))));
}

fn lone_references_0( loop_ends_1 : vec2<u32>) -> vec2<u32>
{
    return (loop_ends_1 & ((((mask_shl1_0(loop_ends_1)) | ((mask_bit_0(u32(0))))))));
}

fn read_header_0( m_5 : u32) -> Header_0
{
    var h_0 : Header_0;
    var fields_0 : u32 = load_word_0(group_table_0 + u32(3) * (m_5 / u32(32)) + u32(2));
    var start_0 : u32 = meshlet_start_0(m_5);
    var _S23 : bool;
    if(m_5 >= meshlet_total_0)
    {
        _S23 = true;
    }
    else
    {
        _S23 = start_0 >= (byte_length_0 - u32(8));
    }
    var start_1 : u32;
    if(_S23)
    {
        error_0 = u32(1);
        start_1 = u32(0);
    }
    else
    {
        start_1 = start_0;
    }
    var p_6 : u32 = u32(8) * start_1;
    var bits_1 : u32 = load_bits_0(p_6, u32(16));
    var reference_width_0 : u32 = (((fields_0 >> (u32(13)))) & (u32(7)));
    h_0.meshlet_0 = m_5;
    h_0.triangles_0 = ((bits_1 & (u32(63)))) + u32(1);
    h_0.references_0 = (((((bits_1 >> (u32(6)))) & ((((u32(1) << (reference_width_0))) - u32(1))))) & (u32(63)));
    var _S24 : u32 = u32(6) + reference_width_0;
    var _S25 : u32 = (bits_1 >> (_S24));
    var p_7 : u32 = p_6 + _S24;
    h_0.flags_0 = u32(0);
    var bits_2 : u32 = _S25;
    var flag_0 : u32 = u32(1);
    var p_8 : u32 = p_7;
    for(;;)
    {
        if(flag_0 <= u32(4))
        {
        }
        else
        {
            break;
        }
        if(((((fields_0 >> (u32(16)))) & (flag_0))) != u32(0))
        {
            if(((bits_2 & (u32(1)))) != u32(0))
            {
                h_0.flags_0 = ((h_0.flags_0) | (flag_0));
            }
            var _S26 : u32 = p_8 + u32(1);
            bits_2 = (bits_2 >> (u32(1)));
            p_8 = _S26;
        }
        flag_0 = flag_0 + flag_0;
    }
    h_0.delta_width_0 = (((fields_0 >> (u32(5)))) & (u32(31)));
    h_0.slot_width_0 = (((fields_0 >> (u32(10)))) & (u32(7)));
    h_0.table_0 = (((fields_0 >> (u32(19)))) & (u32(1)));
    h_0.begin_0 = p_8;
    var _S27 : Planes_0 = load_planes_0(p_8, h_0.triangles_0);
    var r_0 : u32 = h_0.references_0;
    var all_0 : vec2<u32> = mask_below_0(h_0.references_0);
    var _S28 : vec2<u32> = mask_none_0();
    h_0.foreign_refs_0 = _S28;
    h_0.private_refs_0 = _S28;
    h_0.loop_ends_0 = _S28;
    h_0.length_width_0 = u32(0);
    if((h_0.references_0) == u32(0))
    {
        _S23 = (h_0.flags_0) != u32(0);
    }
    else
    {
        _S23 = false;
    }
    if(_S23)
    {
        error_0 = u32(4);
    }
    if(r_0 > u32(0))
    {
        h_0.foreign_refs_0 = load_mask_0(_S27.end_1, r_0);
        var p_9 : u32 = _S27.end_1 + r_0;
        var _S29 : u32 = r_0 - u32(1);
        h_0.loop_ends_0 = mask_bit_0(_S29);
        if((((h_0.flags_0) & (u32(1)))) != u32(0))
        {
            var _S30 : vec2<u32> = load_mask_0(p_9, r_0);
            h_0.loop_ends_0 = _S30;
            var p_10 : u32 = p_9 + r_0;
            if(!mask_test_0(_S30, _S29))
            {
                error_0 = u32(4);
            }
            p_8 = p_10;
        }
        else
        {
            p_8 = p_9;
        }
        if((((h_0.flags_0) & (u32(2)))) != u32(0))
        {
            var _S31 : vec2<u32> = load_mask_0(p_8, r_0);
            h_0.private_refs_0 = _S31;
            var p_11 : u32 = p_8 + r_0;
            if(mask_any_0((_S31 & ((h_0.foreign_refs_0)))))
            {
                error_0 = u32(4);
            }
            p_8 = p_11;
        }
        var _S32 : u32 = load_bits_0(p_8, u32(3));
        h_0.length_width_0 = _S32;
        var p_12 : u32 = p_8 + u32(3);
        if(_S32 > u32(6))
        {
            error_0 = u32(4);
        }
        p_8 = p_12;
    }
    else
    {
        p_8 = _S27.end_1;
    }
    var _S33 : vec2<u32> = (all_0 & ((~(((h_0.foreign_refs_0) | ((h_0.private_refs_0)))))));
    h_0.owned_refs_0 = _S33;
    var _S34 : vec2<u32> = (_S33 | ((((h_0.private_refs_0) & ((~lone_references_0(h_0.loop_ends_0)))))));
    h_0.sized_refs_0 = _S34;
    h_0.lengths_0 = p_8;
    var p_13 : u32 = p_8 + h_0.length_width_0 * mask_count_0(_S34);
    h_0.entries_0 = p_13;
    var _S35 : u32 = h_0.delta_width_0 + h_0.slot_width_0;
    if((((h_0.flags_0) & (u32(4)))) != u32(0))
    {
        start_1 = stream_total_0 - u32(1);
    }
    else
    {
        start_1 = u32(0);
    }
    var _S36 : u32 = _S35 + start_1;
    h_0.entry_width_0 = _S36;
    h_0.codes_0 = p_13 + _S36 * mask_count_0(h_0.foreign_refs_0);
    return h_0;
}

var<private> opened_0 : Header_0;

fn scatter_word_0( bits_3 : u32,  m_6 : u32) -> u32
{
    var _S37 : u32 = m_6;
    var _S38 : u32 = bits_3;
    var scattered_0 : u32 = u32(0);
    for(;;)
    {
        if(_S37 != u32(0))
        {
        }
        else
        {
            break;
        }
        var scattered_1 : u32 = (scattered_0 | (((((_S37 & ((u32(0) - _S37)))) & ((u32(0) - ((_S38 & (u32(1))))))))));
        var _S39 : u32 = (_S38 >> (u32(1)));
        _S37 = (_S37 & ((_S37 - u32(1))));
        _S38 = _S39;
        scattered_0 = scattered_1;
    }
    return scattered_0;
}

fn mask_scatter_0( bits_4 : vec2<u32>,  m_7 : vec2<u32>) -> vec2<u32>
{
    var _S40 : u32 = m_7.x;
    var low_1 : u32 = countOneBits(_S40);
    var next_0 : u32;
    if(low_1 == u32(0))
    {
        next_0 = bits_4.x;
    }
    else
    {
        if(low_1 == u32(32))
        {
            next_0 = bits_4.y;
        }
        else
        {
            next_0 = ((((bits_4.x) >> (low_1))) | ((((bits_4.y) << ((u32(32) - low_1))))));
        }
    }
    return vec2<u32>(scatter_word_0(bits_4.x, _S40), scatter_word_0(next_0, m_7.y));
}

fn choose_0( condition_0 : bool,  a_0 : vec2<u32>,  b_0 : vec2<u32>) -> vec2<u32>
{
    var _S41 : vec2<u32>;
    if(condition_0)
    {
        _S41 = a_0;
    }
    else
    {
        _S41 = b_0;
    }
    return _S41;
}

struct SymbolMasks_0
{
     r_1 : vec2<u32>,
     e_0 : vec2<u32>,
     c_0 : vec2<u32>,
     s_2 : vec2<u32>,
};

fn symbol_masks_0( planes_1 : Planes_0,  triangles_2 : u32,  table_1 : u32) -> SymbolMasks_0
{
    var after_first_0 : vec2<u32> = mask_scatter_0(planes_1.p1_0, planes_1.p0_0);
    var after_second_0 : vec2<u32> = mask_scatter_0(planes_1.p2_0, after_first_0);
    var _S42 : u32 = triangles_2 - u32(1);
    var last_0 : vec2<u32> = mask_bit_0(_S42);
    var first_2 : vec2<u32> = ((planes_1.p0_0) & ((~after_first_0)));
    var second_0 : vec2<u32> = (after_first_0 & ((~after_second_0)));
    var y_0 : SymbolMasks_0;
    var _S43 : vec2<u32> = mask_scatter_0(planes_1.p3_0, after_second_0);
    y_0.s_2 = _S43;
    y_0.r_1 = ((mask_below_0(_S42)) & ((~planes_1.p0_0)));
    var _S44 : bool = table_1 == u32(0);
    y_0.c_0 = choose_0(_S44, first_2, second_0);
    y_0.e_0 = ((choose_0(_S44, second_0, (after_second_0 & ((~_S43))))) | (last_0));
    return y_0;
}

var<private> symbol_r_0 : vec2<u32>;

var<private> symbol_e_0 : vec2<u32>;

var<private> symbol_c_0 : vec2<u32>;

var<private> symbol_s_0 : vec2<u32>;

fn read_symbols_0( h_1 : Header_0)
{
    var y_1 : SymbolMasks_0 = symbol_masks_0(load_planes_0(h_1.begin_0, h_1.triangles_0), h_1.triangles_0, h_1.table_0);
    triangle_count_0 = h_1.triangles_0;
    symbol_r_0 = y_1.r_1;
    symbol_e_0 = y_1.e_0;
    symbol_c_0 = y_1.c_0;
    symbol_s_0 = y_1.s_2;
    return;
}

var<private> disk_starts_0 : vec2<u32>;

var<private> disk_count_0 : u32;

var<private> boundary_0 : vec2<u32>;

var<private> disk_first_0 : array<u32, i32(65)>;

fn mask_lsb_0( m_8 : vec2<u32>) -> u32
{
    var _S45 : u32 = m_8.x;
    var _S46 : u32;
    if(_S45 != u32(0))
    {
        _S46 = firstbitlow_0(_S45);
    }
    else
    {
        var _S47 : u32 = m_8.y;
        if(_S47 != u32(0))
        {
            _S46 = u32(32) + firstbitlow_0(_S47);
        }
        else
        {
            _S46 = u32(64);
        }
    }
    return _S46;
}

var<private> apex_0 : array<u32, i32(64)>;

fn mask_msb_0( m_9 : vec2<u32>) -> u32
{
    var _S48 : u32 = m_9.y;
    var _S49 : u32;
    if(_S48 != u32(0))
    {
        _S49 = u32(32) + firstbithigh_0(_S48);
    }
    else
    {
        var _S50 : u32 = m_9.x;
        if(_S50 != u32(0))
        {
            _S49 = firstbithigh_0(_S50);
        }
        else
        {
            _S49 = u32(64);
        }
    }
    return _S49;
}

var<private> disk_gate_0 : array<u32, i32(64)>;

fn mask_clear_lsb_0( m_10 : vec2<u32>) -> vec2<u32>
{
    var _S51 : u32 = m_10.x;
    var _S52 : vec2<u32>;
    if(_S51 != u32(0))
    {
        _S52 = vec2<u32>((_S51 & ((_S51 - u32(1)))), m_10.y);
    }
    else
    {
        var _S53 : u32 = m_10.y;
        _S52 = vec2<u32>(u32(0), (_S53 & ((_S53 - u32(1)))));
    }
    return _S52;
}

fn decode_apexes_0()
{
    var alive_0 : vec2<u32>;
    var _S54 : vec2<u32> = mask_none_0();
    disk_starts_0 = _S54;
    disk_count_0 = u32(0);
    vertex_count_0 = u32(0);
    boundary_0 = _S54;
    var t_0 : u32 = u32(0);
    var fresh_0 : bool = true;
    var alive_1 : vec2<u32> = _S54;
    var pending_0 : vec2<u32> = _S54;
    var pushed_0 : vec2<u32> = _S54;
    var count_5 : u32 = u32(0);
    for(;;)
    {
        if(t_0 < triangle_count_0)
        {
        }
        else
        {
            break;
        }
        var count_6 : u32;
        if(fresh_0)
        {
            if(count_5 >= u32(64))
            {
                error_0 = u32(3);
                return;
            }
            disk_starts_0 = (disk_starts_0 | ((mask_bit_0(t_0))));
            disk_first_0[disk_count_0] = count_5;
            disk_count_0 = disk_count_0 + u32(1);
            var _S55 : u32 = count_5 + u32(1);
            alive_0 = (alive_1 | ((mask_bit_0(count_5))));
            count_6 = _S55;
        }
        else
        {
            alive_0 = alive_1;
            count_6 = count_5;
        }
        var _S56 : vec2<u32> = ~mask_below_0(t_0);
        var ends_0 : vec2<u32> = (symbol_e_0 & (_S56));
        if(!mask_any_0(ends_0))
        {
            error_0 = u32(2);
            return;
        }
        var q_0 : u32 = mask_lsb_0(ends_0);
        var strip_0 : vec2<u32> = ((mask_below_0(q_0)) & (_S56));
        var _S57 : u32 = count_6 + mask_count_0((strip_0 & (symbol_r_0)));
        var _S58 : u32 = _S57 + u32(2);
        if(_S58 > u32(64))
        {
            error_0 = u32(3);
            return;
        }
        var pending_1 : vec2<u32> = (pending_0 | (((strip_0 & ((~symbol_r_0))))));
        var ids_0 : vec2<u32> = ((mask_below_0(_S57)) & ((~mask_below_0(count_6))));
        var _S59 : vec2<u32> = (pushed_0 | (ids_0));
        var alive_2 : vec2<u32> = (alive_0 | (ids_0));
        apex_0[q_0] = _S57;
        var _S60 : vec2<u32> = (((alive_2 | ((mask_bit_0(_S57))))) | ((mask_bit_0(_S57 + u32(1)))));
        var _S61 : u32 = q_0 + u32(1);
        var splits_0 : vec2<u32> = (pending_1 & (symbol_s_0));
        var fresh_1 : bool = !mask_any_0(splits_0);
        var split_0 : u32 = mask_msb_0(splits_0);
        var resolved_0 : vec2<u32>;
        if(fresh_1)
        {
            resolved_0 = pending_1;
        }
        else
        {
            resolved_0 = (pending_1 & ((~mask_below_0(split_0 + u32(1)))));
        }
        var pending_2 : vec2<u32> = (pending_1 & ((~resolved_0)));
        var resolved_1 : vec2<u32> = resolved_0;
        alive_1 = _S60;
        var popped_0 : u32 = u32(0);
        count_5 = _S58;
        for(;;)
        {
            if(mask_any_0(resolved_1))
            {
            }
            else
            {
                break;
            }
            var u_0 : u32 = mask_msb_0(resolved_1);
            var v_0 : u32 = mask_msb_0(alive_1);
            var closes_0 : bool = mask_test_0(symbol_c_0, u_0);
            apex_0[u_0] = v_0;
            var _S62 : u32 = (popped_0 | (v_0));
            var _S63 : vec2<u32> = choose_0(closes_0, (alive_1 & ((~mask_bit_0(v_0)))), (alive_1 | ((mask_bit_0(count_5)))));
            var count_7 : u32 = count_5 + u32(!closes_0);
            resolved_1 = (resolved_1 & ((~mask_bit_0(u_0))));
            alive_1 = _S63;
            popped_0 = _S62;
            count_5 = count_7;
        }
        var last_1 : u32 = mask_msb_0(alive_1);
        var _S64 : bool;
        if(popped_0 >= u32(64))
        {
            _S64 = true;
        }
        else
        {
            _S64 = last_1 >= u32(64);
        }
        if(_S64)
        {
            error_0 = u32(2);
            return;
        }
        if(count_5 > u32(64))
        {
            error_0 = u32(3);
            return;
        }
        if(fresh_1)
        {
            disk_gate_0[disk_count_0 - u32(1)] = last_1;
            pending_0 = pending_2;
        }
        else
        {
            apex_0[split_0] = last_1;
            pending_0 = (pending_2 & ((~mask_bit_0(split_0))));
        }
        t_0 = _S61;
        fresh_0 = fresh_1;
        pushed_0 = _S59;
    }
    if(!fresh_0)
    {
        error_0 = u32(2);
        return;
    }
    alive_0 = symbol_r_0;
    for(;;)
    {
        if(mask_any_0(alive_0))
        {
        }
        else
        {
            break;
        }
        apex_0[mask_lsb_0(alive_0)] = mask_lsb_0(pushed_0);
        var _S65 : vec2<u32> = mask_clear_lsb_0(pushed_0);
        alive_0 = mask_clear_lsb_0(alive_0);
        pushed_0 = _S65;
    }
    disk_first_0[disk_count_0] = count_5;
    vertex_count_0 = count_5;
    boundary_0 = alive_1;
    return;
}

fn open_meshlet_0( m_11 : u32)
{
    error_0 = u32(0);
    unary_0 = seek_unary_0(u32(0));
    triangle_count_0 = u32(0);
    vertex_count_0 = u32(0);
    visited_0.meshlet_0 = u32(4294967295);
    located_0 = u32(4294967295);
    var _S66 : Header_0 = read_header_0(m_11);
    opened_0 = _S66;
    if(error_0 != u32(0))
    {
        return;
    }
    read_symbols_0(opened_0);
    decode_apexes_0();
    return;
}

var<private> seamed_refs_0 : vec2<u32>;

var<private> seam_refs_0 : array<vec2<u32>, i32(64)>;

fn seam_references_0( h_2 : Header_0,  s_3 : u32) -> vec2<u32>
{
    var seams_0 : vec2<u32> = mask_none_0();
    var _S67 : bool;
    if(s_3 == u32(0))
    {
        _S67 = true;
    }
    else
    {
        _S67 = (((h_2.flags_0) & (u32(4)))) == u32(0);
    }
    if(_S67)
    {
        return seams_0;
    }
    var _S68 : u32 = h_2.entries_0 + h_2.delta_width_0 + h_2.slot_width_0 + s_3 - u32(1);
    var rest_1 : vec2<u32> = h_2.foreign_refs_0;
    var seams_1 : vec2<u32> = seams_0;
    var share_0 : u32 = _S68;
    for(;;)
    {
        if(mask_any_0(rest_1))
        {
        }
        else
        {
            break;
        }
        if((load_bits_0(share_0, u32(1))) == u32(0))
        {
            seams_1 = (seams_1 | ((mask_bit_0(mask_lsb_0(rest_1)))));
        }
        var share_1 : u32 = share_0 + h_2.entry_width_0;
        rest_1 = mask_clear_lsb_0(rest_1);
        share_0 = share_1;
    }
    return seams_1;
}

fn find_seams_0( h_3 : Header_0)
{
    seamed_refs_0 = mask_none_0();
    var s_4 : u32 = u32(0);
    for(;;)
    {
        if(s_4 < stream_total_0)
        {
        }
        else
        {
            break;
        }
        var _S69 : vec2<u32> = seam_references_0(h_3, s_4);
        seam_refs_0[s_4] = _S69;
        seamed_refs_0 = (seamed_refs_0 | (_S69));
        s_4 = s_4 + u32(1);
    }
    return;
}

var<private> loop_vertex_0 : array<u32, i32(64)>;

var<private> reference_owner_0 : array<u32, i32(64)>;

fn entry_owner_0( h_4 : Header_0,  entry_0 : u32) -> u32
{
    var delta_0 : u32 = load_bits_0(entry_0, h_4.delta_width_0);
    var _S70 : bool = delta_0 > (h_4.meshlet_0);
    if(_S70)
    {
        error_0 = u32(5);
    }
    var _S71 : u32;
    if(_S70)
    {
        _S71 = u32(0);
    }
    else
    {
        _S71 = h_4.meshlet_0 - delta_0;
    }
    return _S71;
}

var<private> reference_slot_0 : array<u32, i32(64)>;

fn entry_slot_0( h_5 : Header_0,  entry_1 : u32) -> u32
{
    return load_bits_0(entry_1 + h_5.delta_width_0, h_5.slot_width_0);
}

fn visit_0( m_12 : u32)
{
    if((visited_0.meshlet_0) != m_12)
    {
        var _S72 : Header_0 = read_header_0(m_12);
        visited_0 = _S72;
    }
    return;
}

fn slot_reference_0( h_6 : Header_0,  slot_0 : u32) -> u32
{
    var rest_2 : vec2<u32> = h_6.owned_refs_0;
    var i_8 : u32 = u32(0);
    for(;;)
    {
        var _S73 : bool;
        if(i_8 < slot_0)
        {
            _S73 = mask_any_0(rest_2);
        }
        else
        {
            _S73 = false;
        }
        if(_S73)
        {
        }
        else
        {
            break;
        }
        var _S74 : vec2<u32> = mask_clear_lsb_0(rest_2);
        var _S75 : u32 = i_8 + u32(1);
        rest_2 = _S74;
        i_8 = _S75;
    }
    if(!mask_any_0(rest_2))
    {
        error_0 = u32(5);
    }
    return mask_lsb_0(rest_2);
}

fn stored_length_0( h_7 : Header_0,  r_2 : u32) -> u32
{
    return load_bits_0(h_7.lengths_0 + h_7.length_width_0 * mask_count_0(((h_7.sized_refs_0) & ((mask_below_0(r_2))))), h_7.length_width_0) + u32(1);
}

fn read_foreign_length_0( owner_0 : u32,  slot_1 : u32) -> u32
{
    visit_0(owner_0);
    var r_3 : u32 = slot_reference_0(visited_0, slot_1);
    var _S76 : u32;
    if(error_0 == u32(0))
    {
        _S76 = stored_length_0(visited_0, r_3);
    }
    else
    {
        _S76 = u32(1);
    }
    return _S76;
}

var<private> reference_rank_0 : array<u32, i32(64)>;

var<private> reference_length_0 : array<u32, i32(64)>;

var<private> reference_end_0 : array<u32, i32(64)>;

fn place_references_0( h_8 : Header_0)
{
    var _S77 : bool;
    var rest_3 : vec2<u32> = boundary_0;
    var places_0 : u32 = u32(0);
    for(;;)
    {
        if(mask_any_0(rest_3))
        {
        }
        else
        {
            break;
        }
        loop_vertex_0[places_0] = mask_lsb_0(rest_3);
        var _S78 : u32 = places_0 + u32(1);
        rest_3 = mask_clear_lsb_0(rest_3);
        places_0 = _S78;
    }
    var disk_0 : u32 = u32(0);
    var rank_0 : u32 = u32(0);
    var r_4 : u32 = u32(0);
    var entry_2 : u32 = h_8.entries_0;
    var lengths_1 : u32 = h_8.lengths_0;
    for(;;)
    {
        if(disk_0 < disk_count_0)
        {
        }
        else
        {
            break;
        }
        var _S79 : u32 = disk_0 + u32(1);
        var length_0 : u32 = mask_count_0((boundary_0 & ((((mask_below_0(disk_first_0[_S79])) & ((~mask_below_0(disk_first_0[disk_0]))))))));
        var _S80 : bool = (h_8.references_0) > u32(0);
        var more_0 : bool = _S80;
        var rank_1 : u32 = rank_0;
        var entry_3 : u32 = entry_2;
        var lengths_2 : u32 = lengths_1;
        for(;;)
        {
            if(more_0)
            {
            }
            else
            {
                break;
            }
            if(r_4 >= (h_8.references_0))
            {
                _S77 = true;
            }
            else
            {
                _S77 = rank_1 >= (rank_0 + length_0);
            }
            if(_S77)
            {
                error_0 = u32(4);
                return;
            }
            var n_4 : u32;
            if(mask_test_0(h_8.foreign_refs_0, r_4))
            {
                var _S81 : u32 = entry_owner_0(h_8, entry_3);
                reference_owner_0[r_4] = _S81;
                reference_slot_0[r_4] = entry_slot_0(h_8, entry_3);
                var entry_4 : u32 = entry_3 + h_8.entry_width_0;
                if(error_0 != u32(0))
                {
                    return;
                }
                var _S82 : u32 = read_foreign_length_0(reference_owner_0[r_4], reference_slot_0[r_4]);
                if(error_0 != u32(0))
                {
                    return;
                }
                n_4 = _S82;
                entry_3 = entry_4;
            }
            else
            {
                var lengths_3 : u32;
                if(mask_test_0(h_8.sized_refs_0, r_4))
                {
                    var lengths_4 : u32 = lengths_2 + h_8.length_width_0;
                    n_4 = load_bits_0(lengths_2, h_8.length_width_0) + u32(1);
                    lengths_3 = lengths_4;
                }
                else
                {
                    n_4 = length_0;
                    lengths_3 = lengths_2;
                }
                lengths_2 = lengths_3;
            }
            reference_rank_0[r_4] = rank_1;
            reference_length_0[r_4] = n_4;
            var rank_2 : u32 = rank_1 + n_4;
            var more_1 : bool = !mask_test_0(h_8.loop_ends_0, r_4);
            if(rank_2 > (rank_0 + length_0))
            {
                error_0 = u32(4);
                return;
            }
            if(more_1)
            {
                places_0 = loop_vertex_0[(rank_2 & (u32(63)))];
            }
            else
            {
                places_0 = loop_vertex_0[rank_0];
            }
            reference_end_0[r_4] = places_0;
            var _S83 : u32 = r_4 + u32(1);
            more_0 = more_1;
            r_4 = _S83;
            rank_1 = rank_2;
        }
        if(_S80)
        {
            _S77 = rank_1 != (rank_0 + length_0);
        }
        else
        {
            _S77 = false;
        }
        if(_S77)
        {
            error_0 = u32(4);
            return;
        }
        var _S84 : u32 = rank_0 + length_0;
        disk_0 = _S79;
        rank_0 = _S84;
        entry_2 = entry_3;
        lengths_1 = lengths_2;
    }
    if(r_4 != (h_8.references_0))
    {
        error_0 = u32(4);
    }
    return;
}

fn pack4_0( x_0 : u32,  y_2 : u32,  z_0 : u32,  w_0 : u32) -> u32
{
    return (((((x_0 | (((y_2 << (u32(8))))))) | (((z_0 << (u32(16))))))) | (((w_0 << (u32(24))))));
}

fn job_triangles_0() -> u32
{
    return u32(64) * job_place_0;
}

fn decode_triangles_0()
{
    var gate_0 : u32 = u32(0);
    var splits_1 : vec2<u32> = symbol_s_0;
    var t_1 : u32 = u32(0);
    var disk_1 : u32 = u32(0);
    for(;;)
    {
        if(t_1 < triangle_count_0)
        {
        }
        else
        {
            break;
        }
        var gate_1 : u32;
        if(mask_test_0(disk_starts_0, t_1))
        {
            var _S85 : u32 = disk_1 + u32(1);
            gate_1 = pack4_0(disk_gate_0[disk_1], disk_first_0[disk_1], u32(0), u32(255));
            disk_1 = _S85;
        }
        else
        {
            gate_1 = gate_0;
        }
        var _S86 : u32 = mask_lsb_0((symbol_e_0 & ((~mask_below_0(t_1)))));
        var gate_2 : u32 = gate_1;
        for(;;)
        {
            if(t_1 <= _S86)
            {
            }
            else
            {
                break;
            }
            var v_1 : u32 = apex_0[t_1];
            all_triangles_0[job_triangles_0() + t_1] = (gate_2 | ((((apex_0[t_1]) << (u32(16))))));
            var place_0 : u32;
            if(mask_test_0(symbol_r_0, t_1))
            {
                place_0 = u32(8);
            }
            else
            {
                place_0 = u32(0);
            }
            var _S87 : u32 = (((((gate_2 & (((u32(65280) >> (place_0)))))) | (((v_1 << (place_0)))))) | (((((gate_2 >> (place_0))) << (u32(24))))));
            var _S88 : u32 = t_1 + u32(1);
            gate_2 = _S87;
            t_1 = _S88;
        }
        var last_2 : u32 = mask_msb_0((splits_1 & ((mask_below_0(t_1)))));
        if(last_2 < u32(64))
        {
            var _S89 : vec2<u32> = (splits_1 & ((~mask_bit_0(last_2))));
            gate_0 = pack4_0((all_triangles_0[job_triangles_0() + last_2] & (u32(255))), (((all_triangles_0[job_triangles_0() + last_2] >> (u32(16)))) & (u32(255))), u32(0), (((all_triangles_0[job_triangles_0() + last_2] >> (u32(8)))) & (u32(255))));
            splits_1 = _S89;
        }
        else
        {
            gate_0 = gate_2;
        }
    }
    return;
}

fn inner_vertex_0( r_5 : u32,  i_9 : u32) -> u32
{
    return loop_vertex_0[reference_rank_0[r_5] + i_9];
}

fn known_vertices_0( h_9 : Header_0) -> vec2<u32>
{
    var _S90 : vec2<u32> = boundary_0;
    var known_0 : vec2<u32>;
    var i_10 : u32;
    if((h_9.references_0) == u32(0))
    {
        known_0 = mask_none_0();
        i_10 = u32(0);
        for(;;)
        {
            if(i_10 < disk_count_0)
            {
            }
            else
            {
                break;
            }
            var _S91 : vec2<u32> = (known_0 | ((mask_bit_0(disk_first_0[i_10]))));
            var _S92 : u32 = i_10 + u32(1);
            known_0 = _S91;
            i_10 = _S92;
        }
    }
    else
    {
        known_0 = _S90;
    }
    var rest_4 : vec2<u32> = h_9.private_refs_0;
    for(;;)
    {
        if(mask_any_0(rest_4))
        {
        }
        else
        {
            break;
        }
        var _S93 : u32 = mask_lsb_0(rest_4);
        i_10 = u32(1);
        for(;;)
        {
            if(i_10 < (reference_length_0[_S93]))
            {
            }
            else
            {
                break;
            }
            var _S94 : vec2<u32> = (known_0 & ((~mask_bit_0(inner_vertex_0(_S93, i_10)))));
            var _S95 : u32 = i_10 + u32(1);
            known_0 = _S94;
            i_10 = _S95;
        }
        rest_4 = mask_clear_lsb_0(rest_4);
    }
    return known_0;
}

var<private> traversed_0 : array<u32, i32(65)>;

var<private> traversed_count_0 : u32;

fn list_interior_0()
{
    var rest_5 : vec2<u32> = symbol_c_0;
    var distinct_0 : bool = true;
    var count_8 : u32 = u32(0);
    for(;;)
    {
        if(mask_any_0(rest_5))
        {
        }
        else
        {
            break;
        }
        var triangle_0 : u32 = all_triangles_0[job_triangles_0() + mask_lsb_0(rest_5)];
        traversed_0[count_8] = all_triangles_0[job_triangles_0() + mask_lsb_0(rest_5)];
        var _S96 : u32 = count_8 + u32(1);
        if(distinct_0)
        {
            distinct_0 = ((((triangle_0 ^ (((triangle_0 >> (u32(8))))))) & (u32(255)))) != u32(0);
        }
        else
        {
            distinct_0 = false;
        }
        rest_5 = mask_clear_lsb_0(rest_5);
        count_8 = _S96;
    }
    traversed_count_0 = count_8;
    if(!distinct_0)
    {
        error_0 = u32(2);
    }
    return;
}

fn list_with_private_0( waiting_0 : vec2<u32>)
{
    var _S97 : vec2<u32> = waiting_0;
    var t_2 : u32 = u32(0);
    var count_9 : u32 = u32(0);
    for(;;)
    {
        if(t_2 < triangle_count_0)
        {
        }
        else
        {
            break;
        }
        var triangle_1 : u32 = all_triangles_0[job_triangles_0() + t_2];
        var a_1 : u32 = (all_triangles_0[job_triangles_0() + t_2] & (u32(255)));
        var b_1 : u32 = (((all_triangles_0[job_triangles_0() + t_2] >> (u32(8)))) & (u32(255)));
        var v_2 : u32 = (((all_triangles_0[job_triangles_0() + t_2] >> (u32(16)))) & (u32(255)));
        var _S98 : bool;
        if(mask_test_0(disk_starts_0, t_2))
        {
            _S98 = mask_test_0(_S97, a_1);
        }
        else
        {
            _S98 = false;
        }
        var _S99 : vec2<u32>;
        var count_10 : u32;
        if(_S98)
        {
            traversed_0[count_9] = pack4_0(b_1, b_1, a_1, b_1);
            var _S100 : u32 = count_9 + u32(1);
            _S99 = (_S97 & ((~mask_bit_0(a_1))));
            count_10 = _S100;
        }
        else
        {
            _S99 = _S97;
            count_10 = count_9;
        }
        traversed_0[count_10] = triangle_1;
        var _S101 : bool;
        if(mask_test_0(symbol_c_0, t_2))
        {
            _S101 = true;
        }
        else
        {
            _S101 = mask_test_0(_S99, v_2);
        }
        var _S102 : u32;
        if(_S101)
        {
            _S102 = u32(1);
        }
        else
        {
            _S102 = u32(0);
        }
        var count_11 : u32 = count_10 + _S102;
        var _S103 : vec2<u32> = (_S99 & ((~mask_bit_0(v_2))));
        var _S104 : u32 = t_2 + u32(1);
        _S97 = _S103;
        t_2 = _S104;
        count_9 = count_11;
    }
    traversed_count_0 = count_9;
    if(mask_any_0(_S97))
    {
        error_0 = u32(2);
    }
    return;
}

fn list_traversed_0( known_1 : vec2<u32>)
{
    list_interior_0();
    var _S105 : vec2<u32> = ~known_1;
    if(mask_any_0((boundary_0 & (_S105))))
    {
        list_with_private_0((boundary_0 & (_S105)));
    }
    return;
}

fn connect_meshlet_0()
{
    find_seams_0(opened_0);
    place_references_0(opened_0);
    if(error_0 != u32(0))
    {
        return;
    }
    decode_triangles_0();
    list_traversed_0(known_vertices_0(opened_0));
    return;
}

fn loop_begin_0( h_10 : Header_0,  r_6 : u32) -> u32
{
    var before_0 : vec2<u32> = ((h_10.loop_ends_0) & ((mask_below_0(r_6))));
    var _S106 : u32;
    if(mask_any_0(before_0))
    {
        _S106 = mask_msb_0(before_0) + u32(1);
    }
    else
    {
        _S106 = u32(0);
    }
    return _S106;
}

fn previous_reference_0( h_11 : Header_0,  r_7 : u32) -> u32
{
    var _S107 : u32;
    if(r_7 == (loop_begin_0(h_11, r_7)))
    {
        _S107 = mask_lsb_0(((h_11.loop_ends_0) & ((~mask_below_0(r_7)))));
    }
    else
    {
        _S107 = r_7 - u32(1);
    }
    return _S107;
}

fn shared_references_0( h_12 : Header_0,  s_5 : u32) -> vec2<u32>
{
    return ((h_12.foreign_refs_0) & ((~seam_refs_0[s_5])));
}

fn corner_source_0( h_13 : Header_0,  r_8 : u32,  before_1 : u32,  s_6 : u32) -> u32
{
    var shared_refs_0 : vec2<u32> = shared_references_0(h_13, s_6);
    var from_r_0 : bool = mask_test_0(shared_refs_0, r_8);
    var from_before_0 : bool = mask_test_0(shared_refs_0, before_1);
    var _S108 : bool;
    if(from_r_0)
    {
        _S108 = from_before_0;
    }
    else
    {
        _S108 = false;
    }
    var _S109 : u32;
    if(_S108)
    {
        if((reference_owner_0[before_1]) < (reference_owner_0[r_8]))
        {
            _S109 = before_1;
        }
        else
        {
            _S109 = r_8;
        }
        return _S109;
    }
    if(from_r_0)
    {
        _S109 = r_8;
    }
    else
    {
        if(from_before_0)
        {
            _S109 = before_1;
        }
        else
        {
            _S109 = u32(64);
        }
    }
    return _S109;
}

fn next_reference_0( h_14 : Header_0,  r_9 : u32) -> u32
{
    var _S110 : u32;
    if(mask_test_0(h_14.loop_ends_0, r_9))
    {
        _S110 = loop_begin_0(h_14, r_9);
    }
    else
    {
        _S110 = r_9 + u32(1);
    }
    return _S110;
}

fn stored_corners_0( h_15 : Header_0,  seams_2 : vec2<u32>) -> vec2<u32>
{
    var own_0 : vec2<u32> = ((((mask_below_0(h_15.references_0)) & ((~h_15.foreign_refs_0)))) | (seams_2));
    var _S111 : vec2<u32> = mask_shl1_0((own_0 & ((~h_15.loop_ends_0))));
    var rest_6 : vec2<u32> = h_15.loop_ends_0;
    var before_2 : vec2<u32> = _S111;
    var first_3 : u32 = u32(0);
    for(;;)
    {
        if(mask_any_0(rest_6))
        {
        }
        else
        {
            break;
        }
        var last_3 : u32 = mask_lsb_0(rest_6);
        if(mask_test_0(own_0, last_3))
        {
            before_2 = (before_2 | ((mask_bit_0(first_3))));
        }
        var _S112 : u32 = last_3 + u32(1);
        rest_6 = mask_clear_lsb_0(rest_6);
        first_3 = _S112;
    }
    return (own_0 & (before_2));
}

var<private> code_cursor_0 : u32;

var<private> chain_code_0 : array<u32, i32(64)>;

var<private> chain_widths_0 : array<u32, i32(64)>;

fn read_code_0( s_7 : u32,  base_4 : u32,  is_chain_0 : bool) -> u32
{
    var field_1 : u32 = load_bits_0(code_cursor_0, u32(3));
    code_cursor_0 = code_cursor_0 + u32(3);
    if(field_1 == u32(7))
    {
        code_cursor_0 = code_cursor_0 + u32(5) * stream_elements_0[s_7];
        return u32(255);
    }
    var exponential_0 : bool;
    if(field_1 >= u32(4))
    {
        exponential_0 = !is_chain_0;
    }
    else
    {
        exponential_0 = false;
    }
    var _S113 : u32 = base_4 + field_1;
    var k_0 : u32;
    if(exponential_0)
    {
        k_0 = max(base_4, u32(1)) - u32(1) + field_1 - u32(4);
    }
    else
    {
        k_0 = _S113;
    }
    if(k_0 > u32(31))
    {
        error_0 = u32(7);
    }
    var _S114 : u32 = (k_0 & (u32(31)));
    if(exponential_0)
    {
        k_0 = u32(32);
    }
    else
    {
        k_0 = u32(0);
    }
    return _S114 + k_0;
}

var<private> interior_widths_0 : array<u32, i32(64)>;

var<private> interior_code_0 : array<u32, i32(64)>;

fn read_list_codes_0( p_14 : u32,  chains_0 : bool) -> u32
{
    code_cursor_0 = p_14;
    var s_8 : u32 = u32(0);
    for(;;)
    {
        if(s_8 < stream_total_0)
        {
        }
        else
        {
            break;
        }
        chain_code_0[s_8] = u32(0);
        if(chains_0)
        {
            chain_widths_0[s_8] = code_cursor_0 + u32(3);
            var _S115 : u32 = read_code_0(s_8, stream_chain_base_0[s_8], true);
            chain_code_0[s_8] = _S115;
        }
        interior_widths_0[s_8] = code_cursor_0 + u32(3);
        var _S116 : u32 = read_code_0(s_8, stream_interior_base_0[s_8], false);
        interior_code_0[s_8] = _S116;
        s_8 = s_8 + u32(1);
    }
    return code_cursor_0;
}

var<private> chain_total_0 : u32;

var<private> anchor_position_0 : array<u32, i32(64)>;

var<private> anchor_count_0 : array<u32, i32(64)>;

fn first_anchor_bits_0( s_9 : u32) -> u32
{
    return stream_elements_0[s_9] * stream_bits_0[s_9];
}

fn anchor_width_0( s_10 : u32,  fields_1 : u32,  c_1 : u32) -> u32
{
    var field_2 : u32 = load_bits_0(fields_1 + u32(3) * c_1, u32(3));
    var bits_5 : u32 = stream_bits_0[s_10];
    var _S117 : u32;
    if(field_2 == u32(7))
    {
        _S117 = bits_5;
    }
    else
    {
        _S117 = min(stream_anchor_base_0[s_10] + field_2, bits_5);
    }
    return _S117;
}

fn further_anchor_bits_0( s_11 : u32) -> u32
{
    var _S118 : u32 = anchor_position_0[s_11] + first_anchor_bits_0(s_11);
    var c_2 : u32 = u32(0);
    var sum_0 : u32 = u32(0);
    for(;;)
    {
        if(c_2 < (stream_elements_0[s_11]))
        {
        }
        else
        {
            break;
        }
        var sum_1 : u32 = sum_0 + anchor_width_0(s_11, _S118, c_2);
        c_2 = c_2 + u32(1);
        sum_0 = sum_1;
    }
    return sum_0;
}

fn anchor_bits_0( s_12 : u32) -> u32
{
    var count_12 : u32 = anchor_count_0[s_12];
    if((anchor_count_0[s_12]) <= u32(1))
    {
        return count_12 * first_anchor_bits_0(s_12);
    }
    return first_anchor_bits_0(s_12) + u32(3) * stream_elements_0[s_12] + (count_12 - u32(1)) * further_anchor_bits_0(s_12);
}

var<private> chain_low_0 : array<u32, i32(64)>;

fn width_field_0( position_0 : u32) -> u32
{
    var w_1 : u32 = load_bits_0(position_0, u32(5));
    var _S119 : u32;
    if(w_1 == u32(31))
    {
        _S119 = u32(32);
    }
    else
    {
        _S119 = w_1;
    }
    return _S119;
}

fn fixed_bits_0( s_13 : u32,  widths_0 : u32) -> u32
{
    var c_3 : u32 = u32(0);
    var sum_2 : u32 = u32(0);
    for(;;)
    {
        if(c_3 < (stream_elements_0[s_13]))
        {
        }
        else
        {
            break;
        }
        var sum_3 : u32 = sum_2 + width_field_0(widths_0 + u32(5) * c_3);
        c_3 = c_3 + u32(1);
        sum_2 = sum_3;
    }
    return sum_2;
}

fn low_bits_0( s_14 : u32,  code_0 : u32,  widths_1 : u32) -> u32
{
    var _S120 : u32;
    if(code_0 == u32(255))
    {
        _S120 = fixed_bits_0(s_14, widths_1);
    }
    else
    {
        _S120 = code_0 * stream_elements_0[s_14];
    }
    return _S120;
}

var<private> chain_unary_0 : u32;

fn find_lists_0( h_16 : Header_0,  loops_0 : u32)
{
    var chains_1 : bool = mask_any_0(h_16.owned_refs_0);
    var _S121 : u32 = read_list_codes_0(h_16.codes_0, chains_1);
    chain_total_0 = u32(0);
    var rest_7 : vec2<u32> = h_16.owned_refs_0;
    for(;;)
    {
        if(mask_any_0(rest_7))
        {
        }
        else
        {
            break;
        }
        chain_total_0 = chain_total_0 + (stored_length_0(h_16, mask_lsb_0(rest_7)) - u32(1));
        rest_7 = mask_clear_lsb_0(rest_7);
    }
    var count_13 : u32 = loops_0;
    var s_15 : u32 = u32(0);
    var p_15 : u32 = _S121;
    for(;;)
    {
        if(s_15 < stream_total_0)
        {
        }
        else
        {
            break;
        }
        var _S122 : bool;
        if((h_16.references_0) > u32(0))
        {
            if(s_15 == u32(0))
            {
                _S122 = true;
            }
            else
            {
                _S122 = (((h_16.flags_0) & (u32(4)))) != u32(0);
            }
        }
        else
        {
            _S122 = false;
        }
        if(_S122)
        {
            count_13 = mask_count_0(stored_corners_0(h_16, seam_references_0(h_16, s_15)));
        }
        anchor_position_0[s_15] = p_15;
        anchor_count_0[s_15] = count_13;
        var p_16 : u32 = p_15 + anchor_bits_0(s_15);
        s_15 = s_15 + u32(1);
        p_15 = p_16;
    }
    s_15 = u32(0);
    for(;;)
    {
        if(s_15 < stream_total_0)
        {
        }
        else
        {
            break;
        }
        chain_low_0[s_15] = p_15;
        if(chains_1)
        {
            p_15 = p_15 + chain_total_0 * low_bits_0(s_15, chain_code_0[s_15], chain_widths_0[s_15]);
        }
        s_15 = s_15 + u32(1);
    }
    chain_unary_0 = p_15;
    return;
}

fn locate_visited_0()
{
    if(located_0 == (visited_0.meshlet_0))
    {
        return;
    }
    find_lists_0(visited_0, u32(0));
    located_0 = visited_0.meshlet_0;
    return;
}

fn unzigzag_0( u_1 : u32) -> u32
{
    return (((u_1 >> (u32(1)))) ^ ((u32(0) - ((u_1 & (u32(1)))))));
}

fn job_values_0() -> u32
{
    return push_0.value_words_0 * (job_place_0 - push_0.first_0);
}

fn read_anchor_0( s_16 : u32,  index_0 : u32,  vertex_0 : u32)
{
    var elements_0 : u32 = stream_elements_0[s_16];
    var bits_6 : u32 = stream_bits_0[s_16];
    var first_4 : u32 = anchor_position_0[s_16];
    var fields_2 : u32 = anchor_position_0[s_16] + stream_elements_0[s_16] * stream_bits_0[s_16];
    var further_0 : u32 = fields_2 + u32(3) * stream_elements_0[s_16];
    var further_1 : u32;
    if(index_0 > u32(1))
    {
        further_1 = further_0 + (index_0 - u32(1)) * further_anchor_bits_0(s_16);
    }
    else
    {
        further_1 = further_0;
    }
    var c_4 : u32 = u32(0);
    for(;;)
    {
        if(c_4 < elements_0)
        {
        }
        else
        {
            break;
        }
        var value_2 : u32 = load_bits_0(first_4 + c_4 * bits_6, bits_6);
        var value_3 : u32;
        if(index_0 > u32(0))
        {
            var width_1 : u32 = anchor_width_0(s_16, fields_2, c_4);
            var further_2 : u32 = further_1 + width_1;
            value_3 = value_2 + unzigzag_0(load_bits_0(further_1, width_1));
            further_1 = further_2;
        }
        else
        {
            value_3 = value_2;
        }
        all_values_0[job_values_0() + (u32(64) * stream_element_0[s_16] + vertex_0 + u32(64) * c_4)] = (value_3 & ((stream_mask_0[s_16])));
        c_4 = c_4 + u32(1);
    }
    return;
}

fn entry_position_0( h_17 : Header_0,  r_10 : u32) -> u32
{
    return h_17.entries_0 + h_17.entry_width_0 * mask_count_0(((h_17.foreign_refs_0) & ((mask_below_0(r_10)))));
}

fn fetch_corner_0( owner_1 : u32,  slot_2 : u32,  at_end_0 : bool,  vertex_1 : u32,  s_17 : u32,  apart_0 : bool) -> u32
{
    var end_2 : u32 = owner_1;
    var i_11 : u32 = slot_2;
    var _S123 : bool = apart_0;
    var hop_0 : u32 = u32(0);
    for(;;)
    {
        if(hop_0 < u32(8))
        {
        }
        else
        {
            break;
        }
        visit_0(end_2);
        var r_11 : u32 = slot_reference_0(visited_0, i_11);
        if(error_0 != u32(0))
        {
            return u32(1);
        }
        if(_S123)
        {
            _S123 = true;
        }
        else
        {
            _S123 = (((visited_0.flags_0) & (u32(4)))) != u32(0);
        }
        var corner_0 : u32;
        if(at_end_0)
        {
            corner_0 = next_reference_0(visited_0, r_11);
        }
        else
        {
            corner_0 = r_11;
        }
        var seams_3 : vec2<u32> = seam_references_0(visited_0, s_17);
        var stored_0 : vec2<u32> = stored_corners_0(visited_0, seams_3);
        if(mask_test_0(stored_0, corner_0))
        {
            if(_S123)
            {
                end_2 = s_17 + u32(1);
            }
            else
            {
                end_2 = stream_end_0;
            }
            locate_visited_0();
            var _S124 : u32 = mask_count_0((stored_0 & ((mask_below_0(corner_0)))));
            i_11 = s_17;
            for(;;)
            {
                if(i_11 < end_2)
                {
                }
                else
                {
                    break;
                }
                if(is_decoded_0(i_11))
                {
                    read_anchor_0(i_11, _S124, vertex_1);
                }
                i_11 = i_11 + u32(1);
            }
            return end_2 - s_17;
        }
        var onward_0 : u32;
        if(at_end_0)
        {
            onward_0 = corner_0;
        }
        else
        {
            onward_0 = previous_reference_0(visited_0, r_11);
        }
        if(!mask_test_0(((visited_0.foreign_refs_0) & ((~seams_3))), onward_0))
        {
            error_0 = u32(5);
            return u32(1);
        }
        var entry_5 : u32 = entry_position_0(visited_0, onward_0);
        var _S125 : u32 = entry_owner_0(visited_0, entry_5);
        var _S126 : u32 = entry_slot_0(visited_0, entry_5);
        if(error_0 != u32(0))
        {
            return u32(1);
        }
        var _S127 : u32 = hop_0 + u32(1);
        end_2 = _S125;
        i_11 = _S126;
        hop_0 = _S127;
    }
    error_0 = u32(6);
    return u32(1);
}

fn read_foreign_corners_0( h_18 : Header_0)
{
    var _S128 : bool = mask_any_0(seamed_refs_0);
    var r_12 : u32 = u32(0);
    for(;;)
    {
        if(r_12 < (h_18.references_0))
        {
        }
        else
        {
            break;
        }
        var _S129 : u32 = previous_reference_0(h_18, r_12);
        var _S130 : u32 = loop_vertex_0[reference_rank_0[r_12]];
        var _S131 : u32;
        if(needs_positions_0)
        {
            _S131 = u32(0);
        }
        else
        {
            _S131 = stream_first_0;
        }
        var s_18 : u32 = _S131;
        for(;;)
        {
            var _S132 : bool;
            if(s_18 < stream_end_0)
            {
                _S132 = error_0 == u32(0);
            }
            else
            {
                _S132 = false;
            }
            if(_S132)
            {
            }
            else
            {
                break;
            }
            var source_0 : u32 = corner_source_0(h_18, r_12, _S129, s_18);
            if(!is_decoded_0(s_18))
            {
                s_18 = s_18 + u32(1);
            }
            else
            {
                var s_19 : u32;
                if(source_0 == u32(64))
                {
                    if(_S128)
                    {
                        s_19 = s_18 + u32(1);
                    }
                    else
                    {
                        s_19 = stream_end_0;
                    }
                }
                else
                {
                    var _S133 : u32 = fetch_corner_0(reference_owner_0[source_0], reference_slot_0[source_0], source_0 == r_12, _S130, s_18, _S128);
                    s_19 = s_18 + _S133;
                }
                s_18 = s_19;
            }
        }
        r_12 = r_12 + u32(1);
    }
    return;
}

var<private> chain_count_0 : u32;

var<private> chain_step_0 : array<u32, i32(64)>;

var<private> chain_left_0 : array<u32, i32(64)>;

fn list_chain_0( r_13 : u32,  backwards_0 : bool)
{
    var _S134 : u32 = reference_length_0[r_13];
    var rank_3 : u32 = reference_rank_0[r_13];
    var before_3 : u32;
    if(backwards_0)
    {
        before_3 = reference_end_0[r_13];
    }
    else
    {
        before_3 = loop_vertex_0[rank_3];
    }
    var _S135 : u32;
    if(backwards_0)
    {
        _S135 = loop_vertex_0[rank_3];
    }
    else
    {
        _S135 = reference_end_0[r_13];
    }
    var earlier_0 : u32 = u32(255);
    var i_12 : u32 = u32(1);
    for(;;)
    {
        var _S136 : bool;
        if(i_12 < _S134)
        {
            _S136 = chain_count_0 < u32(64);
        }
        else
        {
            _S136 = false;
        }
        if(_S136)
        {
        }
        else
        {
            break;
        }
        var _S137 : u32;
        if(backwards_0)
        {
            _S137 = _S134 - i_12;
        }
        else
        {
            _S137 = i_12;
        }
        var v_3 : u32 = loop_vertex_0[((rank_3 + _S137) & (u32(63)))];
        chain_step_0[chain_count_0] = pack4_0(loop_vertex_0[((rank_3 + _S137) & (u32(63)))], before_3, _S135, earlier_0);
        chain_left_0[chain_count_0] = _S134 - i_12 + u32(1);
        chain_count_0 = chain_count_0 + u32(1);
        var _S138 : u32 = i_12 + u32(1);
        earlier_0 = before_3;
        before_3 = v_3;
        i_12 = _S138;
    }
    return;
}

var<private> low_cursor_0 : u32;

fn open_chains_0()
{
    unary_0 = seek_unary_0(chain_unary_0);
    low_cursor_0 = chain_low_0[i32(0)];
    return;
}

fn skip_unary_0( n_5 : u32)
{
    var words_2 : u32 = u32(0);
    var _S139 : u32 = n_5;
    for(;;)
    {
        if(_S139 > u32(0))
        {
        }
        else
        {
            break;
        }
        var ones_0 : u32 = countOneBits(unary_0.window_0);
        if(_S139 <= ones_0)
        {
            words_2 = _S139;
            for(;;)
            {
                if(words_2 > u32(1))
                {
                }
                else
                {
                    break;
                }
                unary_0.window_0 = ((unary_0.window_0) & ((unary_0.window_0 - u32(1))));
                words_2 = words_2 - u32(1);
            }
            unary_0.cursor_0 = unary_0.base_1 + firstbitlow_0(unary_0.window_0) + u32(1);
            unary_0.window_0 = ((unary_0.window_0) & ((unary_0.window_0 - u32(1))));
            return;
        }
        var _S140 : u32 = _S139 - ones_0;
        if(ones_0 > u32(0))
        {
            words_2 = u32(0);
        }
        else
        {
            words_2 = words_2 + u32(1);
        }
        var _S141 : u32 = unary_0.base_1 + u32(32);
        unary_0.base_1 = _S141;
        var _S142 : bool;
        if(((_S141 >> (u32(5)))) >= (push_0.blob_words_0))
        {
            _S142 = true;
        }
        else
        {
            _S142 = words_2 > u32(512);
        }
        if(_S142)
        {
            error_0 = u32(8);
            return;
        }
        unary_0.window_0 = load_word_0(((unary_0.base_1) >> (u32(5))));
        _S139 = _S140;
    }
    return;
}

fn skip_residuals_0( s_20 : u32,  count_14 : u32,  code_1 : u32,  widths_2 : u32)
{
    if(code_1 == u32(255))
    {
        low_cursor_0 = low_cursor_0 + count_14 * fixed_bits_0(s_20, widths_2);
        return;
    }
    var before_4 : u32 = unary_0.cursor_0;
    var n_6 : u32 = count_14 * stream_elements_0[s_20];
    skip_unary_0(n_6);
    low_cursor_0 = low_cursor_0 + n_6 * ((code_1 & (u32(31))));
    if(((code_1 & (u32(32)))) != u32(0))
    {
        low_cursor_0 = low_cursor_0 + (unary_0.cursor_0 - before_4 - n_6);
    }
    return;
}

fn next_quotient_0() -> u32
{
    for(;;)
    {
        if((unary_0.window_0) == u32(0))
        {
        }
        else
        {
            break;
        }
        var _S143 : u32 = unary_0.base_1 + u32(32);
        unary_0.base_1 = _S143;
        var _S144 : bool;
        if(((_S143 >> (u32(5)))) >= (push_0.blob_words_0))
        {
            _S144 = true;
        }
        else
        {
            _S144 = (unary_0.base_1 - unary_0.cursor_0) > u32(16415);
        }
        if(_S144)
        {
            error_0 = u32(8);
            return u32(0);
        }
        unary_0.window_0 = load_word_0(((unary_0.base_1) >> (u32(5))));
    }
    var one_0 : u32 = unary_0.base_1 + firstbitlow_0(unary_0.window_0);
    var quotient_0 : u32 = one_0 - unary_0.cursor_0;
    unary_0.window_0 = ((unary_0.window_0) & ((unary_0.window_0 - u32(1))));
    unary_0.cursor_0 = one_0 + u32(1);
    if(quotient_0 > u32(16383))
    {
        error_0 = u32(8);
    }
    return quotient_0;
}

fn exponential_quotient_0( parameter_0 : u32,  q_1 : u32) -> u32
{
    var _S145 : bool;
    if(q_1 <= u32(31))
    {
        _S145 = (parameter_0 + q_1) <= u32(32);
    }
    else
    {
        _S145 = false;
    }
    if(_S145)
    {
        return q_1;
    }
    error_0 = u32(7);
    return u32(0);
}

fn coded_value_0( code_2 : u32,  q_2 : u32,  low_2 : ptr<function, u32>) -> u32
{
    var k_1 : u32 = (code_2 & (u32(31)));
    var exponential_1 : bool = ((code_2 & (u32(32)))) != u32(0);
    var _S146 : u32;
    if(exponential_1)
    {
        var _S147 : u32 = exponential_quotient_0(k_1, q_2);
        _S146 = _S147;
    }
    else
    {
        _S146 = q_2;
    }
    var width_2 : u32;
    if(exponential_1)
    {
        width_2 = k_1 + _S146;
    }
    else
    {
        width_2 = k_1;
    }
    var bits_7 : u32 = load_bits_0((*low_2), width_2);
    (*low_2) = (*low_2) + width_2;
    if(exponential_1)
    {
        _S146 = ((u32(1) << (_S146))) - u32(1);
    }
    return ((_S146 << (k_1))) + bits_7;
}

fn read_codes_0( n_7 : u32,  code_3 : u32)
{
    var low_3 : u32 = low_cursor_0;
    var i_13 : u32 = u32(0);
    for(;;)
    {
        var _S148 : bool;
        if(i_13 < n_7)
        {
            _S148 = error_0 == u32(0);
        }
        else
        {
            _S148 = false;
        }
        if(_S148)
        {
        }
        else
        {
            break;
        }
        var _S149 : u32 = next_quotient_0();
        var _S150 : u32 = coded_value_0(code_3, _S149, &(low_3));
        all_values_0[job_values_0() + push_0.value_words_0 - u32(512) + i_13] = unzigzag_0(_S150);
        i_13 = i_13 + u32(1);
    }
    low_cursor_0 = low_3;
    if(low_3 > (u32(8) * (byte_length_0 - u32(8))))
    {
        error_0 = u32(8);
    }
    return;
}

fn load_inside_0( p_17 : u32,  n_8 : u32) -> u32
{
    return load_bits_0(p_17, n_8);
}

fn read_residuals_0( s_21 : u32,  count_15 : u32,  code_4 : u32,  widths_3 : u32)
{
    var elements_1 : u32 = stream_elements_0[s_21];
    if(code_4 != u32(255))
    {
        read_codes_0(count_15 * elements_1, code_4);
        return;
    }
    var step_0 : u32 = fixed_bits_0(s_21, widths_3);
    var _S151 : u32 = low_cursor_0;
    var _S152 : u32 = low_cursor_0 + count_15 * step_0;
    low_cursor_0 = _S152;
    if(_S152 > (u32(8) * (byte_length_0 - u32(8))))
    {
        error_0 = u32(8);
        return;
    }
    var c_5 : u32 = u32(0);
    var low_4 : u32 = _S151;
    for(;;)
    {
        if(c_5 < elements_1)
        {
        }
        else
        {
            break;
        }
        var width_3 : u32 = width_field_0(widths_3 + u32(5) * c_5);
        var i_14 : u32 = u32(0);
        for(;;)
        {
            if(i_14 < count_15)
            {
            }
            else
            {
                break;
            }
            all_values_0[job_values_0() + push_0.value_words_0 - u32(512) + (i_14 * elements_1 + c_5)] = unzigzag_0(load_inside_0(low_4 + i_14 * step_0, width_3));
            i_14 = i_14 + u32(1);
        }
        var low_5 : u32 = low_4 + width_3;
        c_5 = c_5 + u32(1);
        low_4 = low_5;
    }
    return;
}

struct Triple_0
{
     x_1 : u32,
     y_3 : u32,
     z_1 : u32,
};

fn grid_position_0( id_0 : u32) -> Triple_0
{
    var p_18 : Triple_0;
    p_18.x_1 = all_values_0[job_values_0() + id_0];
    p_18.y_3 = all_values_0[job_values_0() + (id_0 + u32(64))];
    p_18.z_1 = all_values_0[job_values_0() + (id_0 + u32(128))];
    return p_18;
}

fn difference_0( to_0 : Triple_0,  from_0 : Triple_0) -> Triple_0
{
    var _S153 : Triple_0 = to_0;
    _S153.x_1 = _S153.x_1 - from_0.x_1;
    _S153.y_3 = _S153.y_3 - from_0.y_3;
    _S153.z_1 = _S153.z_1 - from_0.z_1;
    return _S153;
}

fn magnitude_0( x_2 : u32) -> u32
{
    var _S154 : u32;
    if(i32(x_2) < i32(0))
    {
        _S154 = u32(0) - x_2;
    }
    else
    {
        _S154 = x_2;
    }
    return _S154;
}

fn magnitudes_0( v_4 : Triple_0) -> u32
{
    return ((((magnitude_0(v_4.x_1)) | ((magnitude_0(v_4.y_3))))) | ((magnitude_0(v_4.z_1))));
}

fn bit_length_0( x_3 : u32) -> u32
{
    return firstbithigh_0(x_3) + u32(1);
}

fn excess_0( x_4 : u32,  y_4 : u32) -> u32
{
    var _S155 : u32;
    if(x_4 > y_4)
    {
        _S155 = x_4 - y_4;
    }
    else
    {
        _S155 = u32(0);
    }
    return _S155;
}

fn shift_right_0( x_5 : u32,  n_9 : u32) -> u32
{
    return u32((i32(x_5) >> (n_9)));
}

fn shifted_0( v_5 : Triple_0,  n_10 : u32) -> Triple_0
{
    var _S156 : Triple_0 = v_5;
    _S156.x_1 = shift_right_0(_S156.x_1, n_10);
    _S156.y_3 = shift_right_0(_S156.y_3, n_10);
    _S156.z_1 = shift_right_0(_S156.z_1, n_10);
    return _S156;
}

fn dot3_0( v_6 : Triple_0,  w_2 : Triple_0) -> u32
{
    return v_6.x_1 * w_2.x_1 + v_6.y_3 * w_2.y_3 + v_6.z_1 * w_2.z_1;
}

fn signed_quotient_0( x_6 : u32,  d_0 : u32) -> u32
{
    var quotient_1 : u32 = magnitude_0(x_6) / d_0;
    var _S157 : u32;
    if(i32(x_6) < i32(0))
    {
        _S157 = u32(0) - quotient_1;
    }
    else
    {
        _S157 = quotient_1;
    }
    return _S157;
}

struct Weights_0
{
     exist_0 : bool,
     s_22 : u32,
     u_2 : u32,
};

fn affine_weights_0( a_2 : u32,  b_2 : u32,  o_0 : u32,  v_7 : u32) -> Weights_0
{
    var origin_0 : Triple_0 = grid_position_0(a_2);
    var e_1 : Triple_0 = difference_0(grid_position_0(b_2), origin_0);
    var f_0 : Triple_0 = difference_0(grid_position_0(o_0), origin_0);
    var r_14 : Triple_0 = difference_0(grid_position_0(v_7), origin_0);
    var h_19 : u32 = excess_0(bit_length_0(((((magnitudes_0(e_1)) | ((magnitudes_0(f_0))))) | ((magnitudes_0(r_14))))), u32(14));
    var e_2 : Triple_0 = shifted_0(e_1, h_19);
    var f_1 : Triple_0 = shifted_0(f_0, h_19);
    var r_15 : Triple_0 = shifted_0(r_14, h_19);
    var ee_0 : u32 = dot3_0(e_2, e_2);
    var ff_0 : u32 = dot3_0(f_1, f_1);
    var re_0 : u32 = dot3_0(r_15, e_2);
    var rf_0 : u32 = dot3_0(r_15, f_1);
    var n_11 : u32 = bit_length_0((((((ee_0 | (ff_0))) | ((magnitude_0(re_0))))) | ((magnitude_0(rf_0)))));
    var up_0 : u32 = excess_0(u32(15), n_11);
    var down_0 : u32 = excess_0(n_11, u32(15));
    var ee_1 : u32 = shift_right_0((ee_0 << (up_0)), down_0);
    var ef_0 : u32 = shift_right_0(((dot3_0(e_2, f_1)) << (up_0)), down_0);
    var ff_1 : u32 = shift_right_0((ff_0 << (up_0)), down_0);
    var re_1 : u32 = shift_right_0((re_0 << (up_0)), down_0);
    var rf_1 : u32 = shift_right_0((rf_0 << (up_0)), down_0);
    var product_0 : u32 = ee_1 * ff_1;
    var determinant_0 : u32 = product_0 - ef_0 * ef_0;
    var d_1 : u32 = (determinant_0 >> (u32(8)));
    var w_3 : Weights_0;
    var _S158 : bool;
    if(i32(determinant_0) > ((i32(product_0) >> (u32(5)))))
    {
        _S158 = d_1 != u32(0);
    }
    else
    {
        _S158 = false;
    }
    w_3.exist_0 = _S158;
    w_3.s_22 = u32(0);
    w_3.u_2 = u32(0);
    if(!_S158)
    {
        return w_3;
    }
    var _S159 : u32 = signed_quotient_0(re_1 * ff_1 - rf_1 * ef_0, d_1);
    w_3.s_22 = _S159;
    var _S160 : u32 = signed_quotient_0(rf_1 * ee_1 - re_1 * ef_0, d_1);
    w_3.u_2 = _S160;
    if((magnitude_0(_S159)) < u32(1024))
    {
        _S158 = (magnitude_0(w_3.u_2)) < u32(1024);
    }
    else
    {
        _S158 = false;
    }
    w_3.exist_0 = _S158;
    return w_3;
}

fn line_weights_0( a_3 : u32,  b_3 : u32,  v_8 : u32) -> Weights_0
{
    var origin_1 : Triple_0 = grid_position_0(a_3);
    var e_3 : Triple_0 = difference_0(grid_position_0(b_3), origin_1);
    var r_16 : Triple_0 = difference_0(grid_position_0(v_8), origin_1);
    var h_20 : u32 = excess_0(bit_length_0(((magnitudes_0(e_3)) | ((magnitudes_0(r_16))))), u32(10));
    var e_4 : Triple_0 = shifted_0(e_3, h_20);
    var ee_2 : u32 = dot3_0(e_4, e_4);
    var re_2 : u32 = dot3_0(shifted_0(r_16, h_20), e_4);
    var w_4 : Weights_0;
    var _S161 : i32 = i32(ee_2);
    var _S162 : bool;
    if(_S161 > i32(0))
    {
        _S162 = i32(re_2) >= i32(0);
    }
    else
    {
        _S162 = false;
    }
    if(_S162)
    {
        _S162 = i32(re_2) <= _S161;
    }
    else
    {
        _S162 = false;
    }
    w_4.exist_0 = _S162;
    w_4.s_22 = u32(0);
    w_4.u_2 = u32(0);
    if(_S162)
    {
        var _S163 : u32 = (re_2 * u32(256) + ((ee_2 >> (u32(1))))) / ee_2;
        w_4.s_22 = _S163;
    }
    return w_4;
}

fn chain_weights_0( step_1 : u32) -> Weights_0
{
    var v_9 : u32 = (step_1 & (u32(255)));
    var before_5 : u32 = (((step_1 >> (u32(8)))) & (u32(255)));
    var end_3 : u32 = (((step_1 >> (u32(16)))) & (u32(255)));
    var w_5 : Weights_0;
    w_5.exist_0 = false;
    w_5.s_22 = u32(0);
    w_5.u_2 = u32(0);
    var _S164 : u32 = (step_1 >> (u32(24)));
    if(_S164 != u32(255))
    {
        var _S165 : Weights_0 = affine_weights_0(before_5, end_3, _S164, v_9);
        w_5 = _S165;
    }
    if(!w_5.exist_0)
    {
        var _S166 : Weights_0 = line_weights_0(before_5, end_3, v_9);
        w_5 = _S166;
    }
    return w_5;
}

fn affine_point_0( w_6 : Weights_0,  a_4 : u32,  b_4 : u32,  o_1 : u32) -> u32
{
    return a_4 + shift_right_0(w_6.s_22 * (b_4 - a_4) + w_6.u_2 * (o_1 - a_4) + u32(128), u32(8));
}

fn divide_0( x_7 : u32,  n_12 : u32) -> u32
{
    var _S167 : u32 = x_7 / n_12;
    return _S167;
}

fn toward_0( a_5 : u32,  b_5 : u32,  n_13 : u32) -> u32
{
    var _S168 : u32 = divide_0(b_5 - a_5 + ((n_13 >> (u32(1)))) + ((n_13 << (u32(24)))), n_13);
    return a_5 + _S168 - u32(16777216);
}

fn affine_chain_point_0( w_7 : Weights_0,  before_6 : u32,  end_4 : u32,  earlier_1 : u32,  left_0 : u32) -> u32
{
    var _S169 : u32;
    if(w_7.exist_0)
    {
        _S169 = affine_point_0(w_7, before_6, end_4, earlier_1);
    }
    else
    {
        var _S170 : u32 = toward_0(before_6, end_4, left_0);
        _S169 = _S170;
    }
    return _S169;
}

fn predict_affine_chains_0( s_23 : u32)
{
    var _S171 : u32 = stream_element_0[s_23] * u32(64);
    var _S172 : u32 = stream_elements_0[s_23];
    var j_0 : u32 = u32(0);
    var from_1 : u32 = u32(0);
    for(;;)
    {
        if(j_0 < chain_count_0)
        {
        }
        else
        {
            break;
        }
        var step_2 : u32 = chain_step_0[j_0];
        var _S173 : Weights_0 = chain_weights_0(chain_step_0[j_0]);
        var _S174 : u32 = _S171 + ((step_2 & (u32(255))));
        var before_7 : u32 = _S171 + ((((step_2 >> (u32(8)))) & (u32(255))));
        var _S175 : u32 = _S171 + ((((step_2 >> (u32(16)))) & (u32(255))));
        var _S176 : u32 = (step_2 >> (u32(24)));
        var _S177 : u32;
        if(_S176 == u32(255))
        {
            _S177 = before_7;
        }
        else
        {
            _S177 = _S171 + _S176;
        }
        var c_6 : u32 = u32(0);
        for(;;)
        {
            if(c_6 < _S172)
            {
            }
            else
            {
                break;
            }
            var _S178 : u32 = u32(64) * c_6;
            var point_0 : u32 = affine_chain_point_0(_S173, all_values_0[job_values_0() + (before_7 + _S178)], all_values_0[job_values_0() + (_S175 + _S178)], all_values_0[job_values_0() + (_S177 + _S178)], chain_left_0[j_0]);
            all_values_0[job_values_0() + (_S174 + _S178)] = ((point_0 + all_values_0[job_values_0() + push_0.value_words_0 - u32(512) + (from_1 + c_6)]) & ((stream_mask_0[s_23])));
            c_6 = c_6 + u32(1);
        }
        var from_2 : u32 = from_1 + _S172;
        j_0 = j_0 + u32(1);
        from_1 = from_2;
    }
    return;
}

fn predict_chain_elements_0( s_24 : u32,  copies_0 : bool,  elements_2 : u32)
{
    var _S179 : u32 = stream_element_0[s_24] * u32(64);
    var _S180 : u32 = stream_mask_0[s_24];
    var _S181 : u32 = chain_count_0;
    var j_1 : u32 = u32(0);
    var from_3 : u32 = u32(0);
    for(;;)
    {
        if(j_1 < _S181)
        {
        }
        else
        {
            break;
        }
        var _S182 : u32 = _S179 + (((chain_step_0[j_1]) & (u32(255))));
        var _S183 : u32 = _S179 + (((((chain_step_0[j_1]) >> (u32(8)))) & (u32(255))));
        var _S184 : u32 = _S179 + (((((chain_step_0[j_1]) >> (u32(16)))) & (u32(255))));
        var _S185 : u32 = chain_left_0[j_1];
        var c_7 : u32 = u32(0);
        for(;;)
        {
            if(c_7 < elements_2)
            {
            }
            else
            {
                break;
            }
            var _S186 : u32 = u32(64) * c_7;
            var point_1 : u32 = all_values_0[job_values_0() + (_S183 + _S186)];
            var point_2 : u32;
            if(!copies_0)
            {
                var _S187 : u32 = toward_0(point_1, all_values_0[job_values_0() + (_S184 + _S186)], _S185);
                point_2 = _S187;
            }
            else
            {
                point_2 = point_1;
            }
            all_values_0[job_values_0() + (_S182 + _S186)] = ((point_2 + all_values_0[job_values_0() + push_0.value_words_0 - u32(512) + (from_3 + c_7)]) & (_S180));
            c_7 = c_7 + u32(1);
        }
        var from_4 : u32 = from_3 + elements_2;
        j_1 = j_1 + u32(1);
        from_3 = from_4;
    }
    return;
}

fn predict_chains_0( s_25 : u32)
{
    var copies_1 : bool = (stream_predictor_0[s_25]) == u32(2);
    var elements_3 : u32 = stream_elements_0[s_25];
    if((stream_predictor_0[s_25]) == u32(5))
    {
        predict_affine_chains_0(s_25);
    }
    else
    {
        var _S188 : bool = !copies_1;
        var _S189 : bool;
        if(_S188)
        {
            _S189 = elements_3 == u32(3);
        }
        else
        {
            _S189 = false;
        }
        if(_S189)
        {
            predict_chain_elements_0(s_25, false, u32(3));
        }
        else
        {
            if(_S188)
            {
                _S189 = elements_3 == u32(2);
            }
            else
            {
                _S189 = false;
            }
            if(_S189)
            {
                predict_chain_elements_0(s_25, false, u32(2));
            }
            else
            {
                predict_chain_elements_0(s_25, copies_1, elements_3);
            }
        }
    }
    return;
}

fn skip_chains_0( h_21 : Header_0,  s_26 : u32)
{
    if(mask_any_0(h_21.owned_refs_0))
    {
        skip_residuals_0(s_26, chain_total_0, chain_code_0[s_26], chain_widths_0[s_26]);
    }
    return;
}

fn read_foreign_chain_0( h_22 : Header_0,  r_17 : u32,  other_0 : u32)
{
    var rest_8 : vec2<u32> = ((visited_0.owned_refs_0) & ((mask_below_0(other_0))));
    var first_5 : u32 = u32(0);
    for(;;)
    {
        if(mask_any_0(rest_8))
        {
        }
        else
        {
            break;
        }
        var first_6 : u32 = first_5 + (stored_length_0(visited_0, mask_lsb_0(rest_8)) - u32(1));
        rest_8 = mask_clear_lsb_0(rest_8);
        first_5 = first_6;
    }
    var _S190 : u32 = reference_length_0[r_17] - u32(1);
    chain_count_0 = u32(0);
    list_chain_0(r_17, true);
    locate_visited_0();
    open_chains_0();
    var s_27 : u32 = u32(0);
    for(;;)
    {
        if(s_27 < stream_end_0)
        {
        }
        else
        {
            break;
        }
        var _S191 : bool;
        if(is_decoded_0(s_27))
        {
            _S191 = mask_test_0(shared_references_0(h_22, s_27), r_17);
        }
        else
        {
            _S191 = false;
        }
        if(_S191)
        {
            skip_residuals_0(s_27, first_5, chain_code_0[s_27], chain_widths_0[s_27]);
            read_residuals_0(s_27, _S190, chain_code_0[s_27], chain_widths_0[s_27]);
            predict_chains_0(s_27);
            skip_residuals_0(s_27, excess_0(chain_total_0, first_5 + _S190), chain_code_0[s_27], chain_widths_0[s_27]);
        }
        else
        {
            skip_chains_0(visited_0, s_27);
        }
        s_27 = s_27 + u32(1);
    }
    return;
}

fn read_foreign_chains_0( h_23 : Header_0)
{
    var rest_9 : vec2<u32> = h_23.foreign_refs_0;
    for(;;)
    {
        if(mask_any_0(rest_9))
        {
        }
        else
        {
            break;
        }
        var r_18 : u32 = mask_lsb_0(rest_9);
        if((reference_length_0[r_18]) > u32(1))
        {
            visit_0(reference_owner_0[r_18]);
            var _S192 : u32 = slot_reference_0(visited_0, reference_slot_0[r_18]);
            read_foreign_chain_0(h_23, r_18, _S192);
        }
        rest_9 = mask_clear_lsb_0(rest_9);
    }
    return;
}

fn read_foreign_0()
{
    if(!mask_any_0(opened_0.foreign_refs_0))
    {
        return;
    }
    read_foreign_corners_0(opened_0);
    if(error_0 == u32(0))
    {
        read_foreign_chains_0(opened_0);
    }
    return;
}

fn read_own_anchors_0( h_24 : Header_0,  s_28 : u32,  stored_1 : vec2<u32>)
{
    var elements_4 : u32 = stream_elements_0[s_28];
    var bits_8 : u32 = stream_bits_0[s_28];
    var count_16 : u32 = anchor_count_0[s_28];
    var fields_3 : u32 = anchor_position_0[s_28] + stream_elements_0[s_28] * stream_bits_0[s_28];
    var _S193 : u32 = anchor_position_0[s_28];
    var _S194 : u32;
    if((anchor_count_0[s_28]) > u32(1))
    {
        _S194 = further_anchor_bits_0(s_28);
    }
    else
    {
        _S194 = u32(0);
    }
    var _S195 : u32 = fields_3 + u32(3) * elements_4;
    var c_8 : u32 = u32(0);
    var first_7 : u32 = _S193;
    var further_3 : u32 = _S195;
    for(;;)
    {
        if(c_8 < elements_4)
        {
        }
        else
        {
            break;
        }
        var width_4 : u32 = anchor_width_0(s_28, fields_3, c_8);
        var value_4 : u32 = load_bits_0(first_7, bits_8);
        var corners_0 : vec2<u32> = stored_1;
        var i_15 : u32 = u32(0);
        var at_0 : u32 = further_3;
        for(;;)
        {
            if(i_15 < count_16)
            {
            }
            else
            {
                break;
            }
            var _S196 : u32 = disk_first_0[i_15];
            var vertex_2 : u32;
            if((h_24.references_0) > u32(0))
            {
                vertex_2 = loop_vertex_0[reference_rank_0[((mask_lsb_0(corners_0)) & (u32(63)))]];
            }
            else
            {
                vertex_2 = _S196;
            }
            var _S197 : vec2<u32> = mask_clear_lsb_0(corners_0);
            var value_5 : u32;
            if(i_15 > u32(0))
            {
                var at_1 : u32 = at_0 + _S194;
                value_5 = value_4 + unzigzag_0(load_bits_0(at_0, width_4));
                at_0 = at_1;
            }
            else
            {
                value_5 = value_4;
            }
            all_values_0[job_values_0() + (u32(64) * stream_element_0[s_28] + vertex_2 + u32(64) * c_8)] = (value_5 & ((stream_mask_0[s_28])));
            var _S198 : u32 = i_15 + u32(1);
            corners_0 = _S197;
            i_15 = _S198;
        }
        var first_8 : u32 = first_7 + bits_8;
        var further_4 : u32 = further_3 + width_4;
        c_8 = c_8 + u32(1);
        first_7 = first_8;
        further_3 = further_4;
    }
    return;
}

fn read_anchors_0( h_25 : Header_0)
{
    var _S199 : bool = mask_any_0(seamed_refs_0);
    var stored_2 : vec2<u32> = stored_corners_0(h_25, mask_none_0());
    var s_29 : u32 = u32(0);
    for(;;)
    {
        if(s_29 < stream_end_0)
        {
        }
        else
        {
            break;
        }
        if(_S199)
        {
            stored_2 = stored_corners_0(h_25, seam_refs_0[s_29]);
        }
        if(is_decoded_0(s_29))
        {
            read_own_anchors_0(h_25, s_29, stored_2);
        }
        s_29 = s_29 + u32(1);
    }
    return;
}

fn read_corners_0()
{
    find_lists_0(opened_0, disk_count_0);
    if(error_0 == u32(0))
    {
        read_anchors_0(opened_0);
    }
    return;
}

fn list_chains_0( refs_0 : vec2<u32>)
{
    chain_count_0 = u32(0);
    var _S200 : vec2<u32> = refs_0;
    for(;;)
    {
        if(mask_any_0(_S200))
        {
        }
        else
        {
            break;
        }
        list_chain_0(mask_lsb_0(_S200), false);
        _S200 = mask_clear_lsb_0(_S200);
    }
    return;
}

fn read_chains_0( h_26 : Header_0)
{
    list_chains_0(h_26.owned_refs_0);
    open_chains_0();
    var s_30 : u32 = u32(0);
    for(;;)
    {
        if(s_30 < stream_total_0)
        {
        }
        else
        {
            break;
        }
        var _S201 : bool;
        if(chain_total_0 > u32(0))
        {
            _S201 = is_decoded_0(s_30);
        }
        else
        {
            _S201 = false;
        }
        if(_S201)
        {
            read_residuals_0(s_30, chain_total_0, chain_code_0[s_30], chain_widths_0[s_30]);
            predict_chains_0(s_30);
        }
        else
        {
            skip_chains_0(h_26, s_30);
        }
        s_30 = s_30 + u32(1);
    }
    return;
}

fn seam_vertices_0( s_31 : u32) -> u32
{
    var rest_10 : vec2<u32> = seam_refs_0[s_31];
    var count_17 : u32 = u32(0);
    for(;;)
    {
        if(mask_any_0(rest_10))
        {
        }
        else
        {
            break;
        }
        var count_18 : u32 = count_17 + (reference_length_0[mask_lsb_0(rest_10)] - u32(1));
        rest_10 = mask_clear_lsb_0(rest_10);
        count_17 = count_18;
    }
    return count_17;
}

fn interior_vertices_0( s_32 : u32) -> u32
{
    return traversed_count_0 + seam_vertices_0(s_32);
}

fn unary_count_0( s_33 : u32,  count_19 : u32,  code_5 : u32) -> u32
{
    var _S202 : u32;
    if(code_5 == u32(255))
    {
        _S202 = u32(0);
    }
    else
    {
        _S202 = count_19 * stream_elements_0[s_33];
    }
    return _S202;
}

fn open_lists_0( p_19 : u32,  n_14 : u32)
{
    unary_0 = seek_unary_0(p_19);
    skip_unary_0(n_14);
    low_cursor_0 = unary_0.cursor_0;
    unary_0 = seek_unary_0(p_19);
    return;
}

struct OctPair_0
{
     u_3 : u32,
     v_10 : u32,
};

fn octahedral_prediction_0( normal_x_0 : u32,  normal_y_0 : u32,  normal_z_0 : u32,  bits_9 : u32) -> OctPair_0
{
    var n_15 : Triple_0;
    n_15.x_1 = normal_x_0;
    n_15.y_3 = normal_y_0;
    n_15.z_1 = normal_z_0;
    var k_2 : u32 = excess_0(bit_length_0(magnitudes_0(n_15)), u32(13));
    var limit_0 : u32 = ((u32(1) << (bits_9))) - u32(2);
    var x_8 : u32 = ((magnitude_0(normal_x_0)) >> (k_2));
    var y_5 : u32 = ((magnitude_0(normal_y_0)) >> (k_2));
    var sum_4 : u32 = x_8 + y_5 + (((magnitude_0(normal_z_0)) >> (k_2)));
    var q_3 : OctPair_0;
    var _S203 : u32 = (limit_0 >> (u32(1)));
    q_3.u_3 = _S203;
    q_3.v_10 = _S203;
    if(sum_4 == u32(0))
    {
        return q_3;
    }
    var below_0 : bool = i32(n_15.z_1) < i32(0);
    var u_4 : u32;
    if(below_0)
    {
        u_4 = sum_4 - y_5;
    }
    else
    {
        u_4 = x_8;
    }
    var v_11 : u32;
    if(below_0)
    {
        v_11 = sum_4 - x_8;
    }
    else
    {
        v_11 = y_5;
    }
    if(i32(n_15.x_1) < i32(0))
    {
        u_4 = sum_4 - u_4;
    }
    else
    {
        u_4 = sum_4 + u_4;
    }
    if(i32(n_15.y_3) < i32(0))
    {
        v_11 = sum_4 - v_11;
    }
    else
    {
        v_11 = sum_4 + v_11;
    }
    var _S204 : u32 = u32(2) * sum_4;
    var _S205 : u32 = (u_4 * limit_0 + sum_4) / _S204;
    q_3.u_3 = _S205;
    var _S206 : u32 = (v_11 * limit_0 + sum_4) / _S204;
    q_3.v_10 = _S206;
    return q_3;
}

fn predict_geo_0( s_34 : u32,  first_9 : u32)
{
    var _S207 : u32 = stream_element_0[s_34] * u32(64);
    var _S208 : u32 = u32(2) * first_9;
    var _S209 : u32 = stream_mask_0[s_34];
    var i_16 : u32 = u32(0);
    var at_2 : u32 = _S208;
    for(;;)
    {
        if(i_16 < traversed_count_0)
        {
        }
        else
        {
            break;
        }
        var v_12 : u32 = ((((traversed_0[i_16]) >> (u32(16)))) & (u32(255)));
        var _S210 : u32 = u32(4) * v_12;
        var q_4 : OctPair_0 = octahedral_prediction_0(all_values_0[job_values_0() + push_0.value_words_0 - u32(256) + _S210], all_values_0[job_values_0() + push_0.value_words_0 - u32(256) + (_S210 + u32(1))], all_values_0[job_values_0() + push_0.value_words_0 - u32(256) + (_S210 + u32(2))], stream_bits_0[s_34]);
        var to_1 : u32 = _S207 + v_12;
        all_values_0[job_values_0() + to_1] = ((q_4.u_3 + all_values_0[job_values_0() + push_0.value_words_0 - u32(512) + at_2]) & (_S209));
        all_values_0[job_values_0() + (to_1 + u32(64))] = ((q_4.v_10 + all_values_0[job_values_0() + push_0.value_words_0 - u32(512) + (at_2 + u32(1))]) & (_S209));
        var at_3 : u32 = at_2 + u32(2);
        i_16 = i_16 + u32(1);
        at_2 = at_3;
    }
    return;
}

fn traversed_weights_0( triangle_2 : u32) -> Weights_0
{
    var w_8 : Weights_0;
    w_8.exist_0 = false;
    w_8.s_22 = u32(0);
    w_8.u_2 = u32(0);
    var _S211 : u32 = (triangle_2 >> (u32(24)));
    if(_S211 != u32(255))
    {
        var _S212 : Weights_0 = affine_weights_0((triangle_2 & (u32(255))), (((triangle_2 >> (u32(8)))) & (u32(255))), _S211, (((triangle_2 >> (u32(16)))) & (u32(255))));
        w_8 = _S212;
    }
    return w_8;
}

fn traversed_prediction_0( predictor_1 : u32,  a_6 : u32,  b_6 : u32,  o_2 : u32,  across_0 : bool) -> u32
{
    if(predictor_1 == u32(2))
    {
        return a_6;
    }
    var sum_5 : u32 = a_6 + b_6;
    var _S213 : bool;
    if(predictor_1 == u32(1))
    {
        _S213 = true;
    }
    else
    {
        _S213 = !across_0;
    }
    if(_S213)
    {
        return (sum_5 >> (u32(1)));
    }
    if(predictor_1 == u32(3))
    {
        return u32((i32(u32(3) * sum_5 - u32(2) * o_2 + u32(2)) >> (u32(2))));
    }
    return sum_5 - o_2;
}

fn choose_1( condition_1 : bool,  a_7 : u32,  b_7 : u32) -> u32
{
    var _S214 : u32;
    if(condition_1)
    {
        _S214 = a_7;
    }
    else
    {
        _S214 = b_7;
    }
    return _S214;
}

fn predict_affine_elements_0( s_35 : u32,  first_10 : u32,  elements_5 : u32)
{
    var _S215 : u32 = stream_element_0[s_35] * u32(64);
    var _S216 : u32 = elements_5 * first_10;
    var _S217 : u32 = stream_mask_0[s_35];
    var _S218 : u32 = traversed_count_0;
    var i_17 : u32 = u32(0);
    var at_4 : u32 = _S216;
    for(;;)
    {
        if(i_17 < _S218)
        {
        }
        else
        {
            break;
        }
        var triangle_3 : u32 = traversed_0[i_17];
        var _S219 : u32 = ((traversed_0[i_17]) >> (u32(24)));
        var across_1 : bool = _S219 != u32(255);
        var _S220 : Weights_0 = traversed_weights_0(traversed_0[i_17]);
        var a_8 : u32 = _S215 + ((triangle_3 & (u32(255))));
        var _S221 : u32 = _S215 + ((((triangle_3 >> (u32(8)))) & (u32(255))));
        var _S222 : u32 = _S215 + ((((triangle_3 >> (u32(16)))) & (u32(255))));
        var _S223 : u32;
        if(across_1)
        {
            _S223 = _S215 + _S219;
        }
        else
        {
            _S223 = a_8;
        }
        var c_9 : u32 = u32(0);
        for(;;)
        {
            if(c_9 < elements_5)
            {
            }
            else
            {
                break;
            }
            var _S224 : u32 = u32(64) * c_9;
            all_values_0[job_values_0() + (_S222 + _S224)] = ((choose_1(_S220.exist_0, affine_point_0(_S220, all_values_0[job_values_0() + (a_8 + _S224)], all_values_0[job_values_0() + (_S221 + _S224)], all_values_0[job_values_0() + (_S223 + _S224)]), traversed_prediction_0(u32(0), all_values_0[job_values_0() + (a_8 + _S224)], all_values_0[job_values_0() + (_S221 + _S224)], all_values_0[job_values_0() + (_S223 + _S224)], across_1)) + all_values_0[job_values_0() + push_0.value_words_0 - u32(512) + (at_4 + c_9)]) & (_S217));
            c_9 = c_9 + u32(1);
        }
        var at_5 : u32 = at_4 + elements_5;
        i_17 = i_17 + u32(1);
        at_4 = at_5;
    }
    return;
}

fn predict_affine_0( s_36 : u32,  first_11 : u32)
{
    if((stream_elements_0[s_36]) == u32(2))
    {
        predict_affine_elements_0(s_36, first_11, u32(2));
    }
    else
    {
        predict_affine_elements_0(s_36, first_11, stream_elements_0[s_36]);
    }
    return;
}

fn predict_elements_0( s_37 : u32,  from_5 : u32,  predictor_2 : u32,  elements_6 : u32)
{
    var _S225 : u32 = stream_element_0[s_37] * u32(64);
    var _S226 : u32 = stream_mask_0[s_37];
    var _S227 : u32 = traversed_count_0;
    var i_18 : u32 = u32(0);
    var at_6 : u32 = from_5;
    for(;;)
    {
        if(i_18 < _S227)
        {
        }
        else
        {
            break;
        }
        var _S228 : u32 = _S225 + (((traversed_0[i_18]) & (u32(255))));
        var _S229 : u32 = _S225 + (((((traversed_0[i_18]) >> (u32(8)))) & (u32(255))));
        var _S230 : u32 = _S225 + (((((traversed_0[i_18]) >> (u32(16)))) & (u32(255))));
        var _S231 : u32 = ((traversed_0[i_18]) >> (u32(24)));
        var _S232 : u32 = _S225 + _S231;
        var _S233 : bool = _S231 != u32(255);
        var c_10 : u32 = u32(0);
        for(;;)
        {
            if(c_10 < elements_6)
            {
            }
            else
            {
                break;
            }
            var beyond_0 : u32;
            if(_S233)
            {
                beyond_0 = all_values_0[job_values_0() + (_S232 + u32(64) * c_10)];
            }
            else
            {
                beyond_0 = u32(0);
            }
            var _S234 : u32 = u32(64) * c_10;
            all_values_0[job_values_0() + (_S230 + _S234)] = ((traversed_prediction_0(predictor_2, all_values_0[job_values_0() + (_S228 + _S234)], all_values_0[job_values_0() + (_S229 + _S234)], beyond_0, _S233) + all_values_0[job_values_0() + push_0.value_words_0 - u32(512) + (at_6 + c_10)]) & (_S226));
            c_10 = c_10 + u32(1);
        }
        var at_7 : u32 = at_6 + elements_6;
        i_18 = i_18 + u32(1);
        at_6 = at_7;
    }
    return;
}

fn predict_traversed_0( s_38 : u32,  first_12 : u32)
{
    var predictor_3 : u32 = stream_predictor_0[s_38];
    var elements_7 : u32 = stream_elements_0[s_38];
    var from_6 : u32 = first_12 * stream_elements_0[s_38];
    if((stream_predictor_0[s_38]) == u32(4))
    {
        predict_geo_0(s_38, first_12);
    }
    else
    {
        if(predictor_3 == u32(5))
        {
            predict_affine_0(s_38, first_12);
        }
        else
        {
            var _S235 : bool = predictor_3 == u32(0);
            var _S236 : bool;
            if(_S235)
            {
                _S236 = elements_7 == u32(3);
            }
            else
            {
                _S236 = false;
            }
            if(_S236)
            {
                predict_elements_0(s_38, from_6, u32(0), u32(3));
            }
            else
            {
                var _S237 : bool = predictor_3 == u32(3);
                if(_S237)
                {
                    _S236 = elements_7 == u32(3);
                }
                else
                {
                    _S236 = false;
                }
                if(_S236)
                {
                    predict_elements_0(s_38, from_6, u32(3), u32(3));
                }
                else
                {
                    if(_S235)
                    {
                        _S236 = elements_7 == u32(2);
                    }
                    else
                    {
                        _S236 = false;
                    }
                    if(_S236)
                    {
                        predict_elements_0(s_38, from_6, u32(0), u32(2));
                    }
                    else
                    {
                        if(_S237)
                        {
                            _S236 = elements_7 == u32(2);
                        }
                        else
                        {
                            _S236 = false;
                        }
                        if(_S236)
                        {
                            predict_elements_0(s_38, from_6, u32(3), u32(2));
                        }
                        else
                        {
                            predict_elements_0(s_38, from_6, predictor_3, elements_7);
                        }
                    }
                }
            }
        }
    }
    return;
}

fn read_own_interior_0( p_20 : u32,  first_13 : u32,  end_5 : u32)
{
    var s_39 : u32 = first_13;
    var codes_1 : u32 = u32(0);
    for(;;)
    {
        if(s_39 < end_5)
        {
        }
        else
        {
            break;
        }
        var codes_2 : u32 = codes_1 + unary_count_0(s_39, interior_vertices_0(s_39), interior_code_0[s_39]);
        s_39 = s_39 + u32(1);
        codes_1 = codes_2;
    }
    open_lists_0(p_20, codes_1);
    s_39 = first_13;
    for(;;)
    {
        if(s_39 < end_5)
        {
        }
        else
        {
            break;
        }
        var count_20 : u32 = interior_vertices_0(s_39);
        if(is_decoded_0(s_39))
        {
            read_residuals_0(s_39, count_20, interior_code_0[s_39], interior_widths_0[s_39]);
            list_chains_0(seam_refs_0[s_39]);
            predict_chains_0(s_39);
            predict_traversed_0(s_39, chain_count_0);
        }
        else
        {
            skip_residuals_0(s_39, count_20, interior_code_0[s_39], interior_widths_0[s_39]);
        }
        s_39 = s_39 + u32(1);
    }
    if(low_cursor_0 > (u32(8) * (byte_length_0 - u32(8))))
    {
        error_0 = u32(8);
    }
    return;
}

fn triangle_normal_0( triangle_4 : u32,  h_27 : u32) -> Triple_0
{
    var a_9 : Triple_0 = shifted_0(grid_position_0((triangle_4 & (u32(63)))), h_27);
    var e_5 : Triple_0 = difference_0(shifted_0(grid_position_0((((triangle_4 >> (u32(8)))) & (u32(63)))), h_27), a_9);
    var f_2 : Triple_0 = difference_0(shifted_0(grid_position_0((((triangle_4 >> (u32(16)))) & (u32(63)))), h_27), a_9);
    var n_16 : Triple_0;
    n_16.x_1 = e_5.y_3 * f_2.z_1 - e_5.z_1 * f_2.y_3;
    n_16.y_3 = e_5.z_1 * f_2.x_1 - e_5.x_1 * f_2.z_1;
    n_16.z_1 = e_5.x_1 * f_2.y_3 - e_5.y_3 * f_2.x_1;
    return n_16;
}

fn sum_normals_0()
{
    var _S238 : u32 = excess_0(stream_bits_0[i32(0)], u32(13));
    var i_19 : u32 = u32(0);
    for(;;)
    {
        if(i_19 < (u32(4) * vertex_count_0))
        {
        }
        else
        {
            break;
        }
        all_values_0[job_values_0() + push_0.value_words_0 - u32(256) + i_19] = u32(0);
        i_19 = i_19 + u32(1);
    }
    var t_3 : u32 = u32(0);
    for(;;)
    {
        if(t_3 < triangle_count_0)
        {
        }
        else
        {
            break;
        }
        var triangle_5 : u32 = all_triangles_0[job_triangles_0() + t_3];
        var _S239 : Triple_0 = triangle_normal_0(all_triangles_0[job_triangles_0() + t_3], _S238);
        var k_3 : u32 = u32(0);
        for(;;)
        {
            if(k_3 < u32(3))
            {
            }
            else
            {
                break;
            }
            var i_20 : u32 = u32(4) * ((((triangle_5 >> ((u32(8) * k_3)))) & (u32(255))));
            all_values_0[job_values_0() + push_0.value_words_0 - u32(256) + i_20] = all_values_0[job_values_0() + push_0.value_words_0 - u32(256) + i_20] + _S239.x_1;
            all_values_0[job_values_0() + push_0.value_words_0 - u32(256) + (i_20 + u32(1))] = all_values_0[job_values_0() + push_0.value_words_0 - u32(256) + (i_20 + u32(1))] + _S239.y_3;
            all_values_0[job_values_0() + push_0.value_words_0 - u32(256) + (i_20 + u32(2))] = all_values_0[job_values_0() + push_0.value_words_0 - u32(256) + (i_20 + u32(2))] + _S239.z_1;
            k_3 = k_3 + u32(1);
        }
        t_3 = t_3 + u32(1);
    }
    return;
}

fn finish_positions_0()
{
    if(needs_normals_0)
    {
        sum_normals_0();
    }
    return;
}

fn read_interiors_0()
{
    read_own_interior_0(unary_0.cursor_0, u32(0), u32(1));
    var _S240 : bool;
    if(error_0 != u32(0))
    {
        _S240 = true;
    }
    else
    {
        _S240 = stream_end_0 <= u32(1);
    }
    if(_S240)
    {
        return;
    }
    finish_positions_0();
    read_own_interior_0(low_cursor_0, u32(1), stream_total_0);
    return;
}

fn decode_meshlet_0( m_13 : u32)
{
    open_meshlet_0(m_13);
    if(error_0 == u32(0))
    {
        connect_meshlet_0();
    }
    if(error_0 == u32(0))
    {
        read_foreign_0();
    }
    if(error_0 == u32(0))
    {
        read_corners_0();
    }
    if(error_0 == u32(0))
    {
        read_chains_0(opened_0);
    }
    if(error_0 == u32(0))
    {
        read_interiors_0();
    }
    return;
}

@compute
@workgroup_size(32, 1, 1)
fn main(@builtin(global_invocation_id) gl_GlobalInvocationID_0 : vec3<u32>)
{
    _S3 = gl_GlobalInvocationID_0;
    var m_14 : u32 = push_0.first_0 + gl_GlobalInvocationID_0.x;
    if(m_14 >= (push_0.meshlets_0))
    {
        return;
    }
    open_job_0(m_14);
    load_streams_0(u32(0), job_streams_0());
    decode_meshlet_0(m_14);
    var _S241 : u32;
    if(error_0 == u32(0))
    {
        _S241 = (triangle_count_0 | (((vertex_count_0 << (u32(8))))));
    }
    else
    {
        _S241 = (error_0 << (u32(16)));
    }
    atomicStore(&(the_summaries_0[m_14]), _S241);
    return;
}

