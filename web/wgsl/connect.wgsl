// Translated from shaders/decoders/connect.comp by tools/build_wgsl.py: do not edit.
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

@binding(3) @group(0) var<storage, read_write> all_triangles_0 : array<u32>;

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

fn job_wanted_0() -> bool
{
    return true;
}

fn job_triangles_0() -> u32
{
    return u32(64) * job_place_0;
}

var<private> connected_triangles_0 : u32;

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
    var _S3 : u32 = ((((load_word_0(u32(1))) >> (u32(8)))) & (u32(255)));
    stream_total_0 = _S3;
    meshlet_total_0 = load_word_0(u32(4));
    byte_length_0 = load_word_0(u32(5));
    group_table_0 = u32(8) + u32(7) * _S3;
    return;
}

var<private> error_0 : u32;

fn load_words2_0( i_3 : u32) -> vec2<u32>
{
    return vec2<u32>(load_memory_0(i_3), load_memory_0(i_3 + u32(1)));
}

fn funnel_0( low_0 : u32,  high_0 : u32,  shift_0 : u32) -> u32
{
    return (((low_0 >> (shift_0))) | (((((high_0 << (u32(1)))) << ((u32(31) - shift_0))))));
}

fn word_below_0( n_0 : u32) -> u32
{
    var _S4 : u32;
    if(n_0 >= u32(32))
    {
        _S4 = u32(4294967295);
    }
    else
    {
        _S4 = ((u32(1) << (n_0))) - u32(1);
    }
    return _S4;
}

fn load_bits_0( p_0 : u32,  n_1 : u32) -> u32
{
    var words_0 : vec2<u32> = load_words2_0((p_0 >> (u32(5))));
    return ((funnel_0(words_0.x, words_0.y, (p_0 & (u32(31))))) & ((word_below_0(n_1))));
}

fn meshlet_start_0( m_0 : u32) -> u32
{
    var group_0 : u32 = group_table_0 + u32(3) * (m_0 / u32(32));
    var base_1 : u32 = load_word_0(group_0);
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
    return base_1 + (((count_0 * width_0 + u32(7)) >> (u32(3)))) + ((line_0 & (u32(65535)))) * i_4 - ((line_0 >> (u32(16)))) + load_bits_0(u32(8) * base_1 + i_4 * width_0, width_0);
}

fn load_words3_0( i_5 : u32) -> vec3<u32>
{
    return vec3<u32>(load_memory_0(i_5), load_memory_0(i_5 + u32(1)), load_memory_0(i_5 + u32(2)));
}

fn mask_below_0( n_2 : u32) -> vec2<u32>
{
    var _S5 : u32 = word_below_0(n_2);
    var _S6 : u32;
    if(n_2 <= u32(32))
    {
        _S6 = u32(0);
    }
    else
    {
        _S6 = word_below_0(n_2 - u32(32));
    }
    return vec2<u32>(_S5, _S6);
}

fn load_mask_0( p_1 : u32,  n_3 : u32) -> vec2<u32>
{
    var words_1 : vec3<u32> = load_words3_0((p_1 >> (u32(5))));
    var _S7 : u32 = words_1.y;
    var _S8 : u32 = (p_1 & (u32(31)));
    return (vec2<u32>(funnel_0(words_1.x, _S7, _S8), funnel_0(_S7, words_1.z, _S8)) & ((mask_below_0(n_3))));
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
     end_0 : u32,
};

fn load_planes_0( begin_0 : u32,  triangles_0 : u32) -> Planes_0
{
    var count_1 : u32 = triangles_0 - u32(1);
    var planes_0 : Planes_0;
    var _S9 : vec2<u32> = load_mask_0(begin_0, count_1);
    planes_0.p0_0 = _S9;
    var p_2 : u32 = begin_0 + count_1;
    var count_2 : u32 = mask_count_0(_S9);
    var _S10 : vec2<u32> = load_mask_0(p_2, count_2);
    planes_0.p1_0 = _S10;
    var p_3 : u32 = p_2 + count_2;
    var count_3 : u32 = mask_count_0(_S10);
    var _S11 : vec2<u32> = load_mask_0(p_3, count_3);
    planes_0.p2_0 = _S11;
    var p_4 : u32 = p_3 + count_3;
    var count_4 : u32 = mask_count_0(_S11);
    planes_0.p3_0 = load_mask_0(p_4, count_4);
    planes_0.end_0 = p_4 + count_4;
    return planes_0;
}

fn mask_none_0() -> vec2<u32>
{
    return vec2<u32>(u32(0));
}

fn mask_bit_0( i_6 : u32) -> vec2<u32>
{
    var _S12 : vec2<u32>;
    if(((i_6 & (u32(32)))) == u32(0))
    {
        _S12 = vec2<u32>((u32(1) << (((i_6 & (u32(31)))))), u32(0));
    }
    else
    {
        _S12 = vec2<u32>(u32(0), (u32(1) << (((i_6 & (u32(31)))))));
    }
    return _S12;
}

fn mask_test_0( m_2 : vec2<u32>,  i_7 : u32) -> bool
{
    var _S13 : u32;
    if(((i_7 & (u32(32)))) == u32(0))
    {
        _S13 = m_2.x;
    }
    else
    {
        _S13 = m_2.y;
    }
    return ((((_S13 >> (((i_7 & (u32(31))))))) & (u32(1)))) != u32(0);
}

fn mask_any_0( m_3 : vec2<u32>) -> bool
{
    return (((m_3.x) | ((m_3.y)))) != u32(0);
}

fn mask_shl1_0( m_4 : vec2<u32>) -> vec2<u32>
{
    var _S14 : u32 = m_4.x;
    return vec2<u32>((_S14 << (u32(1))), ((((m_4.y) << (u32(1)))) | (((_S14 >> (u32(31)))))));
}

fn lone_references_0( loop_ends_1 : vec2<u32>) -> vec2<u32>
{
    return (loop_ends_1 & ((((mask_shl1_0(loop_ends_1)) | ((mask_bit_0(u32(0))))))));
}

struct Header_0
{
     meshlet_0 : u32,
     triangles_1 : u32,
     references_1 : u32,
     flags_0 : u32,
     table_0 : u32,
     begin_1 : u32,
     lengths_1 : u32,
     entries_1 : u32,
     codes_1 : u32,
     length_width_0 : u32,
     delta_width_0 : u32,
     slot_width_0 : u32,
     entry_width_0 : u32,
     foreign_refs_1 : vec2<u32>,
     private_refs_1 : vec2<u32>,
     owned_refs_0 : vec2<u32>,
     sized_refs_0 : vec2<u32>,
     loop_ends_2 : vec2<u32>,
};

fn read_header_0( m_5 : u32) -> Header_0
{
    var h_0 : Header_0;
    var fields_0 : u32 = load_word_0(group_table_0 + u32(3) * (m_5 / u32(32)) + u32(2));
    var start_0 : u32 = meshlet_start_0(m_5);
    var _S15 : bool;
    if(m_5 >= meshlet_total_0)
    {
        _S15 = true;
    }
    else
    {
        _S15 = start_0 >= (byte_length_0 - u32(8));
    }
    var start_1 : u32;
    if(_S15)
    {
        error_0 = u32(1);
        start_1 = u32(0);
    }
    else
    {
        start_1 = start_0;
    }
    var p_5 : u32 = u32(8) * start_1;
    var bits_0 : u32 = load_bits_0(p_5, u32(16));
    var reference_width_0 : u32 = (((fields_0 >> (u32(13)))) & (u32(7)));
    h_0.meshlet_0 = m_5;
    h_0.triangles_1 = ((bits_0 & (u32(63)))) + u32(1);
    h_0.references_1 = (((((bits_0 >> (u32(6)))) & ((((u32(1) << (reference_width_0))) - u32(1))))) & (u32(63)));
    var _S16 : u32 = u32(6) + reference_width_0;
    var _S17 : u32 = (bits_0 >> (_S16));
    var p_6 : u32 = p_5 + _S16;
    h_0.flags_0 = u32(0);
    var bits_1 : u32 = _S17;
    var flag_0 : u32 = u32(1);
    var p_7 : u32 = p_6;
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
            if(((bits_1 & (u32(1)))) != u32(0))
            {
                h_0.flags_0 = ((h_0.flags_0) | (flag_0));
            }
            var _S18 : u32 = p_7 + u32(1);
            bits_1 = (bits_1 >> (u32(1)));
            p_7 = _S18;
        }
        flag_0 = flag_0 + flag_0;
    }
    h_0.delta_width_0 = (((fields_0 >> (u32(5)))) & (u32(31)));
    h_0.slot_width_0 = (((fields_0 >> (u32(10)))) & (u32(7)));
    h_0.table_0 = (((fields_0 >> (u32(19)))) & (u32(1)));
    h_0.begin_1 = p_7;
    var _S19 : Planes_0 = load_planes_0(p_7, h_0.triangles_1);
    var r_0 : u32 = h_0.references_1;
    var all_0 : vec2<u32> = mask_below_0(h_0.references_1);
    var _S20 : vec2<u32> = mask_none_0();
    h_0.foreign_refs_1 = _S20;
    h_0.private_refs_1 = _S20;
    h_0.loop_ends_2 = _S20;
    h_0.length_width_0 = u32(0);
    if((h_0.references_1) == u32(0))
    {
        _S15 = (h_0.flags_0) != u32(0);
    }
    else
    {
        _S15 = false;
    }
    if(_S15)
    {
        error_0 = u32(4);
    }
    if(r_0 > u32(0))
    {
        h_0.foreign_refs_1 = load_mask_0(_S19.end_0, r_0);
        var p_8 : u32 = _S19.end_0 + r_0;
        var _S21 : u32 = r_0 - u32(1);
        h_0.loop_ends_2 = mask_bit_0(_S21);
        if((((h_0.flags_0) & (u32(1)))) != u32(0))
        {
            var _S22 : vec2<u32> = load_mask_0(p_8, r_0);
            h_0.loop_ends_2 = _S22;
            var p_9 : u32 = p_8 + r_0;
            if(!mask_test_0(_S22, _S21))
            {
                error_0 = u32(4);
            }
            p_7 = p_9;
        }
        else
        {
            p_7 = p_8;
        }
        if((((h_0.flags_0) & (u32(2)))) != u32(0))
        {
            var _S23 : vec2<u32> = load_mask_0(p_7, r_0);
            h_0.private_refs_1 = _S23;
            var p_10 : u32 = p_7 + r_0;
            if(mask_any_0((_S23 & ((h_0.foreign_refs_1)))))
            {
                error_0 = u32(4);
            }
            p_7 = p_10;
        }
        var _S24 : u32 = load_bits_0(p_7, u32(3));
        h_0.length_width_0 = _S24;
        var p_11 : u32 = p_7 + u32(3);
        if(_S24 > u32(6))
        {
            error_0 = u32(4);
        }
        p_7 = p_11;
    }
    else
    {
        p_7 = _S19.end_0;
    }
    var _S25 : vec2<u32> = (all_0 & ((~(((h_0.foreign_refs_1) | ((h_0.private_refs_1)))))));
    h_0.owned_refs_0 = _S25;
    var _S26 : vec2<u32> = (_S25 | ((((h_0.private_refs_1) & ((~lone_references_0(h_0.loop_ends_2)))))));
    h_0.sized_refs_0 = _S26;
    h_0.lengths_1 = p_7;
    var p_12 : u32 = p_7 + h_0.length_width_0 * mask_count_0(_S26);
    h_0.entries_1 = p_12;
    var _S27 : u32 = h_0.delta_width_0 + h_0.slot_width_0;
    if((((h_0.flags_0) & (u32(4)))) != u32(0))
    {
        start_1 = stream_total_0 - u32(1);
    }
    else
    {
        start_1 = u32(0);
    }
    var _S28 : u32 = _S27 + start_1;
    h_0.entry_width_0 = _S28;
    h_0.codes_1 = p_12 + _S28 * mask_count_0(h_0.foreign_refs_1);
    return h_0;
}

var<private> opened_0 : Header_0;

var<private> header_sound_0 : bool;

fn scatter_word_0( bits_2 : u32,  m_6 : u32) -> u32
{
    var _S29 : u32 = m_6;
    var _S30 : u32 = bits_2;
    var scattered_0 : u32 = u32(0);
    for(;;)
    {
        if(_S29 != u32(0))
        {
        }
        else
        {
            break;
        }
        var scattered_1 : u32 = (scattered_0 | (((((_S29 & ((u32(0) - _S29)))) & ((u32(0) - ((_S30 & (u32(1))))))))));
        var _S31 : u32 = (_S30 >> (u32(1)));
        _S29 = (_S29 & ((_S29 - u32(1))));
        _S30 = _S31;
        scattered_0 = scattered_1;
    }
    return scattered_0;
}

fn mask_scatter_0( bits_3 : vec2<u32>,  m_7 : vec2<u32>) -> vec2<u32>
{
    var _S32 : u32 = m_7.x;
    var low_1 : u32 = countOneBits(_S32);
    var next_0 : u32;
    if(low_1 == u32(0))
    {
        next_0 = bits_3.x;
    }
    else
    {
        if(low_1 == u32(32))
        {
            next_0 = bits_3.y;
        }
        else
        {
            next_0 = ((((bits_3.x) >> (low_1))) | ((((bits_3.y) << ((u32(32) - low_1))))));
        }
    }
    return vec2<u32>(scatter_word_0(bits_3.x, _S32), scatter_word_0(next_0, m_7.y));
}

fn choose_0( condition_0 : bool,  a_0 : vec2<u32>,  b_0 : vec2<u32>) -> vec2<u32>
{
    var _S33 : vec2<u32>;
    if(condition_0)
    {
        _S33 = a_0;
    }
    else
    {
        _S33 = b_0;
    }
    return _S33;
}

struct SymbolMasks_0
{
     r_1 : vec2<u32>,
     e_0 : vec2<u32>,
     c_0 : vec2<u32>,
     s_0 : vec2<u32>,
};

fn symbol_masks_0( planes_1 : Planes_0,  triangles_2 : u32,  table_1 : u32) -> SymbolMasks_0
{
    var after_first_0 : vec2<u32> = mask_scatter_0(planes_1.p1_0, planes_1.p0_0);
    var after_second_0 : vec2<u32> = mask_scatter_0(planes_1.p2_0, after_first_0);
    var _S34 : u32 = triangles_2 - u32(1);
    var last_0 : vec2<u32> = mask_bit_0(_S34);
    var first_1 : vec2<u32> = ((planes_1.p0_0) & ((~after_first_0)));
    var second_0 : vec2<u32> = (after_first_0 & ((~after_second_0)));
    var y_0 : SymbolMasks_0;
    var _S35 : vec2<u32> = mask_scatter_0(planes_1.p3_0, after_second_0);
    y_0.s_0 = _S35;
    y_0.r_1 = ((mask_below_0(_S34)) & ((~planes_1.p0_0)));
    var _S36 : bool = table_1 == u32(0);
    y_0.c_0 = choose_0(_S36, first_1, second_0);
    y_0.e_0 = ((choose_0(_S36, second_0, (after_second_0 & ((~_S35))))) | (last_0));
    return y_0;
}

var<private> triangle_count_0 : u32;

var<private> symbol_r_0 : vec2<u32>;

var<private> symbol_e_0 : vec2<u32>;

var<private> symbol_c_0 : vec2<u32>;

var<private> symbol_s_0 : vec2<u32>;

fn read_symbols_0( h_1 : Header_0)
{
    var y_1 : SymbolMasks_0 = symbol_masks_0(load_planes_0(h_1.begin_1, h_1.triangles_1), h_1.triangles_1, h_1.table_0);
    triangle_count_0 = h_1.triangles_1;
    symbol_r_0 = y_1.r_1;
    symbol_e_0 = y_1.e_0;
    symbol_c_0 = y_1.c_0;
    symbol_s_0 = y_1.s_0;
    return;
}

var<private> disk_starts_0 : vec2<u32>;

var<private> disk_count_0 : u32;

var<private> vertex_count_0 : u32;

var<private> boundary_1 : vec2<u32>;

var<private> disk_first_0 : array<u32, i32(65)>;

fn mask_lsb_0( m_8 : vec2<u32>) -> u32
{
    var _S37 : u32 = m_8.x;
    var _S38 : u32;
    if(_S37 != u32(0))
    {
        _S38 = firstbitlow_0(_S37);
    }
    else
    {
        var _S39 : u32 = m_8.y;
        if(_S39 != u32(0))
        {
            _S38 = u32(32) + firstbitlow_0(_S39);
        }
        else
        {
            _S38 = u32(64);
        }
    }
    return _S38;
}

var<workgroup> apexes_0 : array<u32, i32(512)>;

fn mask_msb_0( m_9 : vec2<u32>) -> u32
{
    var _S40 : u32 = m_9.y;
    var _S41 : u32;
    if(_S40 != u32(0))
    {
        _S41 = u32(32) + firstbithigh_0(_S40);
    }
    else
    {
        var _S42 : u32 = m_9.x;
        if(_S42 != u32(0))
        {
            _S41 = firstbithigh_0(_S42);
        }
        else
        {
            _S41 = u32(64);
        }
    }
    return _S41;
}

var<private> disk_gate_0 : array<u32, i32(64)>;

fn mask_clear_lsb_0( m_10 : vec2<u32>) -> vec2<u32>
{
    var _S43 : u32 = m_10.x;
    var _S44 : vec2<u32>;
    if(_S43 != u32(0))
    {
        _S44 = vec2<u32>((_S43 & ((_S43 - u32(1)))), m_10.y);
    }
    else
    {
        var _S45 : u32 = m_10.y;
        _S44 = vec2<u32>(u32(0), (_S45 & ((_S45 - u32(1)))));
    }
    return _S44;
}

fn decode_apexes_0()
{
    var alive_0 : vec2<u32>;
    var _S46 : vec2<u32> = mask_none_0();
    disk_starts_0 = _S46;
    disk_count_0 = u32(0);
    vertex_count_0 = u32(0);
    boundary_1 = _S46;
    var t_0 : u32 = u32(0);
    var fresh_0 : bool = true;
    var alive_1 : vec2<u32> = _S46;
    var pending_0 : vec2<u32> = _S46;
    var pushed_0 : vec2<u32> = _S46;
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
            var _S47 : u32 = count_5 + u32(1);
            alive_0 = (alive_1 | ((mask_bit_0(count_5))));
            count_6 = _S47;
        }
        else
        {
            alive_0 = alive_1;
            count_6 = count_5;
        }
        var _S48 : vec2<u32> = ~mask_below_0(t_0);
        var ends_1 : vec2<u32> = (symbol_e_0 & (_S48));
        if(!mask_any_0(ends_1))
        {
            error_0 = u32(2);
            return;
        }
        var q_0 : u32 = mask_lsb_0(ends_1);
        var strip_0 : vec2<u32> = ((mask_below_0(q_0)) & (_S48));
        var _S49 : u32 = count_6 + mask_count_0((strip_0 & (symbol_r_0)));
        var _S50 : u32 = _S49 + u32(2);
        if(_S50 > u32(64))
        {
            error_0 = u32(3);
            return;
        }
        var pending_1 : vec2<u32> = (pending_0 | (((strip_0 & ((~symbol_r_0))))));
        var ids_0 : vec2<u32> = ((mask_below_0(_S49)) & ((~mask_below_0(count_6))));
        var _S51 : vec2<u32> = (pushed_0 | (ids_0));
        var alive_2 : vec2<u32> = (alive_0 | (ids_0));
        var _S52 : u32 = ((q_0 >> (u32(2)))) * u32(32);
        var _S53 : u32 = (insertBits((apexes_0[_S52 + the_thread_0]), (_S49), u32((i32(((q_0 & (u32(3)))) * u32(8)))), u32((i32(8)))));
        apexes_0[_S52 + the_thread_0] = _S53;
        var _S54 : vec2<u32> = (((alive_2 | ((mask_bit_0(_S49))))) | ((mask_bit_0(_S49 + u32(1)))));
        var _S55 : u32 = q_0 + u32(1);
        var splits_1 : vec2<u32> = (pending_1 & (symbol_s_0));
        var fresh_1 : bool = !mask_any_0(splits_1);
        var split_0 : u32 = mask_msb_0(splits_1);
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
        alive_1 = _S54;
        var popped_0 : u32 = u32(0);
        count_5 = _S50;
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
            var _S56 : u32 = ((u_0 >> (u32(2)))) * u32(32);
            var _S57 : u32 = (insertBits((apexes_0[_S56 + the_thread_0]), (v_0), u32((i32(((u_0 & (u32(3)))) * u32(8)))), u32((i32(8)))));
            apexes_0[_S56 + the_thread_0] = _S57;
            var _S58 : u32 = (popped_0 | (v_0));
            var _S59 : vec2<u32> = choose_0(closes_0, (alive_1 & ((~mask_bit_0(v_0)))), (alive_1 | ((mask_bit_0(count_5)))));
            var count_7 : u32 = count_5 + u32(!closes_0);
            resolved_1 = (resolved_1 & ((~mask_bit_0(u_0))));
            alive_1 = _S59;
            popped_0 = _S58;
            count_5 = count_7;
        }
        var last_1 : u32 = mask_msb_0(alive_1);
        var _S60 : bool;
        if(popped_0 >= u32(64))
        {
            _S60 = true;
        }
        else
        {
            _S60 = last_1 >= u32(64);
        }
        if(_S60)
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
            var _S61 : u32 = ((split_0 >> (u32(2)))) * u32(32);
            var _S62 : u32 = (insertBits((apexes_0[_S61 + the_thread_0]), (last_1), u32((i32(((split_0 & (u32(3)))) * u32(8)))), u32((i32(8)))));
            apexes_0[_S61 + the_thread_0] = _S62;
            pending_0 = (pending_2 & ((~mask_bit_0(split_0))));
        }
        t_0 = _S55;
        fresh_0 = fresh_1;
        pushed_0 = _S51;
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
        var _S63 : u32 = mask_lsb_0(alive_0);
        var _S64 : u32 = ((_S63 >> (u32(2)))) * u32(32);
        var _S65 : u32 = (insertBits((apexes_0[_S64 + the_thread_0]), (mask_lsb_0(pushed_0)), u32((i32(((_S63 & (u32(3)))) * u32(8)))), u32((i32(8)))));
        apexes_0[_S64 + the_thread_0] = _S65;
        var _S66 : vec2<u32> = mask_clear_lsb_0(pushed_0);
        alive_0 = mask_clear_lsb_0(alive_0);
        pushed_0 = _S66;
    }
    disk_first_0[disk_count_0] = count_5;
    vertex_count_0 = count_5;
    boundary_1 = alive_1;
    return;
}

fn pack4_0( x_0 : u32,  y_2 : u32,  z_0 : u32,  w_0 : u32) -> u32
{
    return (((((x_0 | (((y_2 << (u32(8))))))) | (((z_0 << (u32(16))))))) | (((w_0 << (u32(24))))));
}

fn decode_triangles_0()
{
    var gate_0 : u32 = u32(0);
    var splits_2 : vec2<u32> = symbol_s_0;
    var t_1 : u32 = u32(0);
    var disk_0 : u32 = u32(0);
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
            var _S67 : u32 = disk_0 + u32(1);
            gate_1 = pack4_0(disk_gate_0[disk_0], disk_first_0[disk_0], u32(0), u32(255));
            disk_0 = _S67;
        }
        else
        {
            gate_1 = gate_0;
        }
        var _S68 : u32 = mask_lsb_0((symbol_e_0 & ((~mask_below_0(t_1)))));
        var gate_2 : u32 = gate_1;
        for(;;)
        {
            if(t_1 <= _S68)
            {
            }
            else
            {
                break;
            }
            var v_1 : u32 = (extractBits((apexes_0[((t_1 >> (u32(2)))) * u32(32) + the_thread_0]), u32((i32(((t_1 & (u32(3)))) * u32(8)))), u32((i32(8)))));
            all_triangles_0[connected_triangles_0 + t_1] = (gate_2 | (((v_1 << (u32(16))))));
            var place_0 : u32;
            if(mask_test_0(symbol_r_0, t_1))
            {
                place_0 = u32(8);
            }
            else
            {
                place_0 = u32(0);
            }
            var _S69 : u32 = (((((gate_2 & (((u32(65280) >> (place_0)))))) | (((v_1 << (place_0)))))) | (((((gate_2 >> (place_0))) << (u32(24))))));
            var _S70 : u32 = t_1 + u32(1);
            gate_2 = _S69;
            t_1 = _S70;
        }
        var last_2 : u32 = mask_msb_0((splits_2 & ((mask_below_0(t_1)))));
        if(last_2 < u32(64))
        {
            var _S71 : vec2<u32> = (splits_2 & ((~mask_bit_0(last_2))));
            gate_0 = pack4_0((all_triangles_0[connected_triangles_0 + last_2] & (u32(255))), (((all_triangles_0[connected_triangles_0 + last_2] >> (u32(16)))) & (u32(255))), u32(0), (((all_triangles_0[connected_triangles_0 + last_2] >> (u32(8)))) & (u32(255))));
            splits_2 = _S71;
        }
        else
        {
            gate_0 = gate_2;
        }
    }
    return;
}

fn connect_0( m_11 : u32) -> bool
{
    load_tables_0();
    error_0 = u32(0);
    var _S72 : Header_0 = read_header_0(m_11);
    opened_0 = _S72;
    header_sound_0 = error_0 == u32(0);
    read_symbols_0(_S72);
    if(error_0 == u32(0))
    {
        decode_apexes_0();
    }
    if(error_0 == u32(0))
    {
        decode_triangles_0();
    }
    if(error_0 != u32(0))
    {
        return false;
    }
    var rest_1 : vec2<u32> = symbol_c_0;
    for(;;)
    {
        if(mask_any_0(rest_1))
        {
        }
        else
        {
            break;
        }
        if(((((all_triangles_0[connected_triangles_0 + mask_lsb_0(rest_1)] ^ (((all_triangles_0[connected_triangles_0 + mask_lsb_0(rest_1)] >> (u32(8))))))) & (u32(255)))) == u32(0))
        {
            error_0 = u32(2);
        }
        rest_1 = mask_clear_lsb_0(rest_1);
    }
    return error_0 == u32(0);
}

struct Places_0
{
     foreign_refs_0 : vec2<u32>,
     private_refs_0 : vec2<u32>,
     loop_ends_0 : vec2<u32>,
     counts_0 : u32,
     lengths_0 : u32,
     entries_0 : u32,
     codes_0 : u32,
     anchors_0 : u32,
     chains_0 : u32,
     quotients_0 : u32,
     interior_0 : u32,
     waiting_0 : vec2<u32>,
};

fn keep_header_0( h_2 : Header_0)
{
    var places_0 : Places_0;
    places_0.foreign_refs_0 = h_2.foreign_refs_1;
    places_0.private_refs_0 = h_2.private_refs_1;
    places_0.loop_ends_0 = h_2.loop_ends_2;
    var _S73 : u32 = (insertBits((u32(0)), (h_2.triangles_1), u32((i32(0))), u32((i32(7)))));
    var _S74 : u32 = (insertBits((_S73), (h_2.references_1), u32((i32(7))), u32((i32(6)))));
    var _S75 : u32 = (insertBits((_S74), (h_2.flags_0), u32((i32(13))), u32((i32(3)))));
    var _S76 : u32 = (insertBits((_S75), (h_2.length_width_0), u32((i32(16))), u32((i32(3)))));
    var _S77 : u32 = (insertBits((_S76), (h_2.delta_width_0), u32((i32(19))), u32((i32(5)))));
    var _S78 : u32 = (insertBits((_S77), (h_2.slot_width_0), u32((i32(24))), u32((i32(3)))));
    places_0.counts_0 = _S78;
    var _S79 : u32;
    if(header_sound_0)
    {
        _S79 = h_2.lengths_1;
    }
    else
    {
        _S79 = u32(4294967295);
    }
    places_0.lengths_0 = _S79;
    places_0.entries_0 = h_2.entries_1;
    places_0.codes_0 = h_2.codes_1;
    all_places_0[job_meshlet_0].foreign_refs_0 = places_0.foreign_refs_0;
    all_places_0[job_meshlet_0].private_refs_0 = places_0.private_refs_0;
    all_places_0[job_meshlet_0].loop_ends_0 = places_0.loop_ends_0;
    all_places_0[job_meshlet_0].counts_0 = places_0.counts_0;
    all_places_0[job_meshlet_0].lengths_0 = places_0.lengths_0;
    all_places_0[job_meshlet_0].entries_0 = places_0.entries_0;
    all_places_0[job_meshlet_0].codes_0 = places_0.codes_0;
    all_places_0[job_meshlet_0].anchors_0 = places_0.anchors_0;
    all_places_0[job_meshlet_0].chains_0 = places_0.chains_0;
    all_places_0[job_meshlet_0].quotients_0 = places_0.quotients_0;
    all_places_0[job_meshlet_0].interior_0 = places_0.interior_0;
    all_places_0[job_meshlet_0].waiting_0 = places_0.waiting_0;
    return;
}

fn connect_shader_0()
{
    var _S80 : u32 = push_0.first_0;
    var _S81 : u32 = the_invocation_0.x / push_0.spread_0;
    var i_8 : u32 = _S80 + _S81;
    var _S82 : bool;
    if(i_8 >= (push_0.meshlets_0))
    {
        _S82 = true;
    }
    else
    {
        var _S83 : u32 = the_thread_0 % push_0.spread_0;
        _S82 = _S83 != u32(0);
    }
    if(_S82)
    {
        return;
    }
    open_job_0(i_8);
    var _S84 : bool = job_wanted_0();
    if(!_S84)
    {
        atomicStore(&(the_summaries_0[job_place_0]), u32(2147483648));
        return;
    }
    connected_triangles_0 = job_triangles_0();
    var _S85 : bool = connect_0(job_meshlet_0);
    keep_header_0(opened_0);
    connectivity_0[job_place_0].boundary_0 = boundary_1;
    connectivity_0[job_place_0].starts_0 = disk_starts_0;
    connectivity_0[job_place_0].closing_0 = symbol_c_0;
    connectivity_0[job_place_0].ends_0 = symbol_e_0;
    connectivity_0[job_place_0].splits_0 = symbol_s_0;
    var summary_0 : u32;
    if(error_0 == u32(0))
    {
        summary_0 = (triangle_count_0 | (((vertex_count_0 << (u32(8))))));
    }
    else
    {
        summary_0 = (error_0 << (u32(16)));
    }
    if(_S84)
    {
    }
    else
    {
        summary_0 = u32(2147483648);
    }
    atomicStore(&(the_summaries_0[job_place_0]), summary_0);
    return;
}

@compute
@workgroup_size(32, 1, 1)
fn connect_main(@builtin(local_invocation_index) thread_0 : u32, @builtin(workgroup_id) workgroup_0 : vec3<u32>, @builtin(global_invocation_id) invocation_0 : vec3<u32>)
{
    the_thread_0 = thread_0;
    the_workgroup_0 = workgroup_0;
    the_invocation_0 = invocation_0;
    connect_shader_0();
    return;
}

