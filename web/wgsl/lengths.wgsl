// Translated from shaders/decoders/lengths.comp by web/build_wgsl.py: do not edit.
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

var<private> _S3 : u32;

var<private> member_0 : u32;

var<private> part_0 : u32;

var<private> _S4 : vec3<u32>;

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
    var _S5 : u32 = ((((load_word_0(u32(1))) >> (u32(8)))) & (u32(255)));
    stream_total_0 = _S5;
    meshlet_total_0 = load_word_0(u32(4));
    byte_length_0 = load_word_0(u32(5));
    group_table_0 = u32(8) + u32(7) * _S5;
    return;
}

var<private> stream_end_0 : u32;

var<workgroup> group_stream_0 : array<u32, i32(8)>;

var<workgroup> group_bases_0 : array<u32, i32(8)>;

fn group_streams_0( end_0 : u32)
{
    load_tables_0();
    var _S6 : u32 = min(stream_total_0, u32(8));
    stream_total_0 = _S6;
    stream_end_0 = min(end_0, _S6);
    var s_0 : u32 = _S3;
    for(;;)
    {
        if(s_0 < stream_total_0)
        {
        }
        else
        {
            break;
        }
        var _S7 : u32 = u32(7) * s_0;
        var shape_0 : u32 = load_word_0(u32(8) + _S7);
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
        group_bases_0[s_0] = load_word_0(u32(9) + _S7);
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
    var _S8 : u32 = (extractBits((group_stream_0[s_1]), u32((i32(0))), u32((i32(3)))));
    if((field_1 * _S8) <= u32(64))
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
    var _S9 : u32 = field_of_0(s_2);
    var _S10 : u32 = (extractBits((group_stream_0[s_2]), u32((i32(0))), u32((i32(3)))));
    return ((_S9 * _S10 + u32(31)) >> (u32(5)));
}

var<workgroup> group_places_0 : array<u32, i32(8)>;

fn group_value_places_0()
{
    var s_3 : u32 = _S3;
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
            var _S11 : u32 = words_of_0(before_1);
            var words_1 : u32 = words_0 + _S11;
            before_1 = before_1 + u32(1);
            words_0 = words_1;
        }
        var _S12 : u32 = ((u32(64) * words_0) & (u32(65535)));
        var _S13 : u32 = words_of_0(s_3);
        var _S14 : u32 = (_S12 | (((_S13 << (u32(16))))));
        var _S15 : u32 = field_of_0(s_3);
        group_places_0[s_3] = (_S14 | (((_S15 << (u32(22))))));
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
    var _S16 : u32 = _S3 / u32(8);
    member_0 = _S16;
    part_0 = _S3 % u32(8);
    var number_0 : u32 = push_0.first_0 + _S4.x * u32(8) + _S16;
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
    var _S17 : bool;
    if(member_0 < u32(8))
    {
        _S17 = number_0 < (push_0.meshlets_0);
    }
    else
    {
        _S17 = false;
    }
    present_0 = _S17;
    if(_S17)
    {
        _S17 = ((summary_0 >> (u32(16)))) == u32(0);
    }
    else
    {
        _S17 = false;
    }
    return _S17;
}

fn word_below_0( n_0 : u32) -> u32
{
    var _S18 : u32;
    if(n_0 >= u32(32))
    {
        _S18 = u32(4294967295);
    }
    else
    {
        _S18 = ((u32(1) << (n_0))) - u32(1);
    }
    return _S18;
}

fn mask_below_0( n_1 : u32) -> vec2<u32>
{
    var _S19 : u32 = word_below_0(n_1);
    var _S20 : u32;
    if(n_1 <= u32(32))
    {
        _S20 = u32(0);
    }
    else
    {
        _S20 = word_below_0(n_1 - u32(32));
    }
    return vec2<u32>(_S19, _S20);
}

fn mask_shl1_0( m_0 : vec2<u32>) -> vec2<u32>
{
    var _S21 : u32 = m_0.x;
    return vec2<u32>((_S21 << (u32(1))), ((((m_0.y) << (u32(1)))) | (((_S21 >> (u32(31)))))));
}

fn mask_bit_0( i_3 : u32) -> vec2<u32>
{
    var _S22 : vec2<u32>;
    if(((i_3 & (u32(32)))) == u32(0))
    {
        _S22 = vec2<u32>((u32(1) << (((i_3 & (u32(31)))))), u32(0));
    }
    else
    {
        _S22 = vec2<u32>(u32(0), (u32(1) << (((i_3 & (u32(31)))))));
    }
    return _S22;
}

fn lone_references_0( loop_ends_1 : vec2<u32>) -> vec2<u32>
{
    return (loop_ends_1 & ((((mask_shl1_0(loop_ends_1)) | ((mask_bit_0(u32(0))))))));
}

struct Header_0
{
     meshlet_0 : u32,
     triangles_0 : u32,
     references_1 : u32,
     flags_0 : u32,
     table_0 : u32,
     begin_0 : u32,
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

fn header_of_0( m_1 : u32) -> Header_0
{
    var places_0 : Places_std430_0 = all_places_0[m_1];
    if((all_places_0[m_1].lengths_0) == u32(4294967295))
    {
        error_0 = u32(4);
    }
    var h_0 : Header_0;
    h_0.meshlet_0 = m_1;
    var _S23 : u32 = (extractBits((places_0.counts_0), u32((i32(0))), u32((i32(7)))));
    h_0.triangles_0 = _S23;
    var _S24 : u32 = (extractBits((places_0.counts_0), u32((i32(7))), u32((i32(6)))));
    h_0.references_1 = _S24;
    var _S25 : u32 = (extractBits((places_0.counts_0), u32((i32(13))), u32((i32(3)))));
    h_0.flags_0 = _S25;
    var _S26 : u32 = (extractBits((places_0.counts_0), u32((i32(16))), u32((i32(3)))));
    h_0.length_width_0 = _S26;
    var _S27 : u32 = (extractBits((places_0.counts_0), u32((i32(19))), u32((i32(5)))));
    h_0.delta_width_0 = _S27;
    var _S28 : u32 = (extractBits((places_0.counts_0), u32((i32(24))), u32((i32(3)))));
    h_0.slot_width_0 = _S28;
    var _S29 : u32 = _S27 + _S28;
    var _S30 : u32;
    if(((_S25 & (u32(4)))) != u32(0))
    {
        _S30 = stream_total_0 - u32(1);
    }
    else
    {
        _S30 = u32(0);
    }
    h_0.entry_width_0 = _S29 + _S30;
    h_0.lengths_1 = places_0.lengths_0;
    h_0.entries_1 = places_0.entries_0;
    h_0.codes_1 = places_0.codes_0;
    h_0.foreign_refs_1 = places_0.foreign_refs_0;
    h_0.private_refs_1 = places_0.private_refs_0;
    h_0.loop_ends_2 = places_0.loop_ends_0;
    var _S31 : vec2<u32> = ((mask_below_0(h_0.references_1)) & ((~(((places_0.foreign_refs_0) | ((places_0.private_refs_0)))))));
    h_0.owned_refs_0 = _S31;
    h_0.sized_refs_0 = (_S31 | ((((places_0.private_refs_0) & ((~lone_references_0(places_0.loop_ends_0)))))));
    return h_0;
}

var<private> triangle_count_0 : u32;

fn open_header_0() -> Header_0
{
    var h_1 : Header_0 = header_of_0(job_meshlet_0);
    triangle_count_0 = h_1.triangles_0;
    return h_1;
}

var<workgroup> group_lengths_0 : array<u32, i32(512)>;

fn mask_test_0( m_2 : vec2<u32>,  i_4 : u32) -> bool
{
    var _S32 : u32;
    if(((i_4 & (u32(32)))) == u32(0))
    {
        _S32 = m_2.x;
    }
    else
    {
        _S32 = m_2.y;
    }
    return ((((_S32 >> (((i_4 & (u32(31))))))) & (u32(1)))) != u32(0);
}

fn mask_count_0( m_3 : vec2<u32>) -> u32
{
    return countOneBits(m_3.x) + countOneBits(m_3.y);
}

fn nth_bit_0( m_4 : vec2<u32>,  n_2 : u32) -> u32
{
    var _S33 : u32 = m_4.x;
    var low_0 : u32 = countOneBits(_S33);
    var _S34 : bool = n_2 < low_0;
    var half_width_0 : u32;
    if(_S34)
    {
        half_width_0 = u32(0);
    }
    else
    {
        half_width_0 = u32(32);
    }
    var word_0 : u32;
    if(_S34)
    {
        word_0 = _S33;
    }
    else
    {
        word_0 = m_4.y;
    }
    var _S35 : u32;
    if(n_2 >= low_0)
    {
        _S35 = n_2 - low_0;
    }
    else
    {
        _S35 = n_2;
    }
    var _S36 : u32 = half_width_0;
    half_width_0 = u32(16);
    var at_0 : u32 = _S36;
    for(;;)
    {
        if(half_width_0 > u32(0))
        {
        }
        else
        {
            break;
        }
        var ones_0 : u32 = countOneBits((word_0 & ((word_below_0(half_width_0)))));
        if(_S35 >= ones_0)
        {
            var _S37 : u32 = _S35 - ones_0;
            var at_1 : u32 = at_0 + half_width_0;
            word_0 = (word_0 >> (half_width_0));
            _S35 = _S37;
            at_0 = at_1;
        }
        half_width_0 = (half_width_0 >> (u32(1)));
    }
    return min(at_0, u32(63));
}

fn pushed_vertices_0( some_0 : vec2<u32>) -> u32
{
    return mask_count_0((some_0 & ((~((symbol_c_0 | (symbol_s_0))))))) + mask_count_0((some_0 & (symbol_e_0)));
}

fn ids_before_0( k_0 : u32) -> u32
{
    var t_0 : u32;
    if(k_0 >= (mask_count_0(the_starts_0)))
    {
        t_0 = triangle_count_0;
    }
    else
    {
        t_0 = nth_bit_0(the_starts_0, k_0);
    }
    return min(u32(64), pushed_vertices_0(mask_below_0(t_0)) + min(k_0, mask_count_0(the_starts_0)));
}

fn loop_of_0( h_2 : Header_0,  r_0 : u32) -> vec2<u32>
{
    var k_1 : u32 = mask_count_0(((h_2.loop_ends_2) & ((mask_below_0(r_0)))));
    return vec2<u32>(mask_count_0((the_boundary_0 & ((mask_below_0(ids_before_0(k_1)))))), mask_count_0((the_boundary_0 & ((mask_below_0(ids_before_0(k_1 + u32(1))))))));
}

fn load_words2_0( i_5 : u32) -> vec2<u32>
{
    return vec2<u32>(load_memory_0(i_5), load_memory_0(i_5 + u32(1)));
}

fn funnel_0( low_1 : u32,  high_0 : u32,  shift_0 : u32) -> u32
{
    return (((low_1 >> (shift_0))) | (((((high_0 << (u32(1)))) << ((u32(31) - shift_0))))));
}

fn load_bits_0( p_0 : u32,  n_3 : u32) -> u32
{
    var words_2 : vec2<u32> = load_words2_0((p_0 >> (u32(5))));
    return ((funnel_0(words_2.x, words_2.y, (p_0 & (u32(31))))) & ((word_below_0(n_3))));
}

fn stored_length_0( h_3 : Header_0,  r_1 : u32) -> u32
{
    return load_bits_0(h_3.lengths_1 + h_3.length_width_0 * mask_count_0(((h_3.sized_refs_0) & ((mask_below_0(r_1))))), h_3.length_width_0) + u32(1);
}

fn entry_position_0( h_4 : Header_0,  r_2 : u32) -> u32
{
    return h_4.entries_1 + h_4.entry_width_0 * mask_count_0(((h_4.foreign_refs_1) & ((mask_below_0(r_2)))));
}

fn entry_owner_0( h_5 : Header_0,  entry_0 : u32) -> u32
{
    var delta_0 : u32 = load_bits_0(entry_0, h_5.delta_width_0);
    var _S38 : bool = delta_0 > (h_5.meshlet_0);
    if(_S38)
    {
        error_0 = u32(5);
    }
    var _S39 : u32;
    if(_S38)
    {
        _S39 = u32(0);
    }
    else
    {
        _S39 = h_5.meshlet_0 - delta_0;
    }
    return _S39;
}

fn entry_slot_0( h_6 : Header_0,  entry_1 : u32) -> u32
{
    return load_bits_0(entry_1 + h_6.delta_width_0, h_6.slot_width_0);
}

fn mask_any_0( m_5 : vec2<u32>) -> bool
{
    return (((m_5.x) | ((m_5.y)))) != u32(0);
}

fn mask_clear_lsb_0( m_6 : vec2<u32>) -> vec2<u32>
{
    var _S40 : u32 = m_6.x;
    var _S41 : vec2<u32>;
    if(_S40 != u32(0))
    {
        _S41 = vec2<u32>((_S40 & ((_S40 - u32(1)))), m_6.y);
    }
    else
    {
        var _S42 : u32 = m_6.y;
        _S41 = vec2<u32>(u32(0), (_S42 & ((_S42 - u32(1)))));
    }
    return _S41;
}

fn mask_lsb_0( m_7 : vec2<u32>) -> u32
{
    var _S43 : u32 = m_7.x;
    var _S44 : u32;
    if(_S43 != u32(0))
    {
        _S44 = firstbitlow_0(_S43);
    }
    else
    {
        var _S45 : u32 = m_7.y;
        if(_S45 != u32(0))
        {
            _S44 = u32(32) + firstbitlow_0(_S45);
        }
        else
        {
            _S44 = u32(64);
        }
    }
    return _S44;
}

fn slot_reference_0( h_7 : Header_0,  slot_0 : u32) -> u32
{
    var rest_0 : vec2<u32> = h_7.owned_refs_0;
    var i_6 : u32 = u32(0);
    for(;;)
    {
        var _S46 : bool;
        if(i_6 < slot_0)
        {
            _S46 = mask_any_0(rest_0);
        }
        else
        {
            _S46 = false;
        }
        if(_S46)
        {
        }
        else
        {
            break;
        }
        var _S47 : vec2<u32> = mask_clear_lsb_0(rest_0);
        var _S48 : u32 = i_6 + u32(1);
        rest_0 = _S47;
        i_6 = _S48;
    }
    if(!mask_any_0(rest_0))
    {
        error_0 = u32(5);
    }
    return mask_lsb_0(rest_0);
}

fn measured_length_0( h_8 : Header_0,  r_3 : u32) -> u32
{
    if(!mask_test_0(((h_8.sized_refs_0) | ((h_8.foreign_refs_1))), r_3))
    {
        var loop_0 : vec2<u32> = loop_of_0(h_8, r_3);
        return loop_0.y - loop_0.x;
    }
    if(!mask_test_0(h_8.foreign_refs_1, r_3))
    {
        return stored_length_0(h_8, r_3);
    }
    var entry_2 : u32 = entry_position_0(h_8, r_3);
    var _S49 : u32 = entry_owner_0(h_8, entry_2);
    var owner_0 : Header_0 = header_of_0(_S49);
    var _S50 : u32 = slot_reference_0(owner_0, entry_slot_0(h_8, entry_2));
    return stored_length_0(owner_0, (_S50 & (u32(63))));
}

fn load_words3_0( i_7 : u32) -> vec3<u32>
{
    return vec3<u32>(load_memory_0(i_7), load_memory_0(i_7 + u32(1)), load_memory_0(i_7 + u32(2)));
}

fn load_mask_0( p_1 : u32,  n_4 : u32) -> vec2<u32>
{
    var words_3 : vec3<u32> = load_words3_0((p_1 >> (u32(5))));
    var _S51 : u32 = words_3.y;
    var _S52 : u32 = (p_1 & (u32(31)));
    return (vec2<u32>(funnel_0(words_3.x, _S51, _S52), funnel_0(_S51, words_3.z, _S52)) & ((mask_below_0(n_4))));
}

fn get_field_0( fields_0 : vec2<u32>,  at_2 : u32,  bits_1 : u32) -> u32
{
    var value_2 : u32;
    if(at_2 < u32(32))
    {
        value_2 = ((((fields_0.x) >> (at_2))) | ((((((fields_0.y) << (u32(1)))) << ((u32(31) - at_2))))));
    }
    else
    {
        value_2 = ((fields_0.y) >> ((at_2 - u32(32))));
    }
    return (value_2 & ((word_below_0(bits_1))));
}

fn chain_vertices_0( h_9 : Header_0,  reference_0 : u32) -> vec2<u32>
{
    var _S53 : vec2<u32> = vec2<u32>(u32(0));
    var _S54 : vec2<u32> = load_mask_0(h_9.lengths_1, u32(64));
    var rest_1 : vec2<u32> = h_9.sized_refs_0;
    var window_0 : vec2<u32> = _S54;
    var used_0 : u32 = u32(0);
    var p_2 : u32 = h_9.lengths_1;
    var count_0 : vec2<u32> = _S53;
    for(;;)
    {
        if(mask_any_0(rest_1))
        {
        }
        else
        {
            break;
        }
        var used_1 : u32;
        if((used_0 + h_9.length_width_0) > u32(64))
        {
            var p_3 : u32 = p_2 + used_0;
            window_0 = load_mask_0(p_3, u32(64));
            used_1 = u32(0);
            p_2 = p_3;
        }
        else
        {
            used_1 = used_0;
        }
        var r_4 : u32 = mask_lsb_0(rest_1);
        var inner_0 : u32;
        if(mask_test_0(h_9.owned_refs_0, r_4))
        {
            inner_0 = get_field_0(window_0, used_1, h_9.length_width_0);
        }
        else
        {
            inner_0 = u32(0);
        }
        var _S55 : u32;
        if(r_4 < reference_0)
        {
            _S55 = inner_0;
        }
        else
        {
            _S55 = u32(0);
        }
        var count_1 : vec2<u32> = count_0 + vec2<u32>(inner_0, _S55);
        var used_2 : u32 = used_1 + h_9.length_width_0;
        rest_1 = mask_clear_lsb_0(rest_1);
        used_0 = used_2;
        count_0 = count_1;
    }
    return count_0;
}

fn code_at_0( p_4 : ptr<function, u32>,  s_4 : u32,  of_chains_0 : bool) -> u32
{
    var field_2 : u32 = load_bits_0((*p_4), u32(3));
    (*p_4) = (*p_4) + u32(3);
    if(field_2 == u32(7))
    {
        var _S56 : u32 = (extractBits((group_stream_0[s_4]), u32((i32(0))), u32((i32(3)))));
        (*p_4) = (*p_4) + u32(5) * _S56;
        return u32(255);
    }
    var base_1 : u32;
    if(of_chains_0)
    {
        var _S57 : u32 = (extractBits((group_bases_0[s_4]), u32((i32(0))), u32((i32(5)))));
        base_1 = _S57;
    }
    else
    {
        var _S58 : u32 = (extractBits((group_bases_0[s_4]), u32((i32(8))), u32((i32(5)))));
        base_1 = _S58;
    }
    var rice_0 : bool;
    if(of_chains_0)
    {
        rice_0 = true;
    }
    else
    {
        rice_0 = field_2 < u32(4);
    }
    var k_2 : u32;
    if(rice_0)
    {
        k_2 = base_1 + field_2;
    }
    else
    {
        k_2 = max(base_1, u32(1)) - u32(1) + field_2 - u32(4);
    }
    if(k_2 > u32(31))
    {
        error_0 = u32(7);
    }
    var _S59 : u32 = (k_2 & (u32(31)));
    if(rice_0)
    {
        base_1 = u32(0);
    }
    else
    {
        base_1 = u32(32);
    }
    return (_S59 | (base_1));
}

fn code_at_1( p_5 : ptr<function, u32>,  s_5 : u32,  of_chains_1 : bool) -> u32
{
    var field_3 : u32 = load_bits_0((*p_5), u32(3));
    (*p_5) = (*p_5) + u32(3);
    if(field_3 == u32(7))
    {
        var _S60 : u32 = (extractBits((group_stream_0[s_5]), u32((i32(0))), u32((i32(3)))));
        (*p_5) = (*p_5) + u32(5) * _S60;
        return u32(255);
    }
    var base_2 : u32;
    if(of_chains_1)
    {
        var _S61 : u32 = (extractBits((group_bases_0[s_5]), u32((i32(0))), u32((i32(5)))));
        base_2 = _S61;
    }
    else
    {
        var _S62 : u32 = (extractBits((group_bases_0[s_5]), u32((i32(8))), u32((i32(5)))));
        base_2 = _S62;
    }
    var rice_1 : bool;
    if(of_chains_1)
    {
        rice_1 = true;
    }
    else
    {
        rice_1 = field_3 < u32(4);
    }
    var k_3 : u32;
    if(rice_1)
    {
        k_3 = base_2 + field_3;
    }
    else
    {
        k_3 = max(base_2, u32(1)) - u32(1) + field_3 - u32(4);
    }
    if(k_3 > u32(31))
    {
        error_0 = u32(7);
    }
    var _S63 : u32 = (k_3 & (u32(31)));
    if(rice_1)
    {
        base_2 = u32(0);
    }
    else
    {
        base_2 = u32(32);
    }
    return (_S63 | (base_2));
}

fn anchors_begin_0( h_10 : Header_0) -> u32
{
    var p_6 : u32 = h_10.codes_1;
    var _S64 : bool = mask_any_0(h_10.owned_refs_0);
    var s_6 : u32 = u32(0);
    for(;;)
    {
        if(s_6 < stream_total_0)
        {
        }
        else
        {
            break;
        }
        if(_S64)
        {
            var _S65 : u32 = code_at_0(&(p_6), s_6, true);
        }
        var _S66 : u32 = code_at_0(&(p_6), s_6, false);
        s_6 = s_6 + u32(1);
    }
    return p_6;
}

fn mask_none_0() -> vec2<u32>
{
    return vec2<u32>(u32(0));
}

fn seam_references_0( h_11 : Header_0,  s_7 : u32) -> vec2<u32>
{
    var seams_0 : vec2<u32> = mask_none_0();
    var _S67 : bool;
    if(s_7 == u32(0))
    {
        _S67 = true;
    }
    else
    {
        _S67 = (((h_11.flags_0) & (u32(4)))) == u32(0);
    }
    if(_S67)
    {
        return seams_0;
    }
    var _S68 : u32 = h_11.entries_1 + h_11.delta_width_0 + h_11.slot_width_0 + s_7 - u32(1);
    var rest_2 : vec2<u32> = h_11.foreign_refs_1;
    var seams_1 : vec2<u32> = seams_0;
    var share_0 : u32 = _S68;
    for(;;)
    {
        if(mask_any_0(rest_2))
        {
        }
        else
        {
            break;
        }
        if((load_bits_0(share_0, u32(1))) == u32(0))
        {
            seams_1 = (seams_1 | ((mask_bit_0(mask_lsb_0(rest_2)))));
        }
        var share_1 : u32 = share_0 + h_11.entry_width_0;
        rest_2 = mask_clear_lsb_0(rest_2);
        share_0 = share_1;
    }
    return seams_1;
}

fn stored_corners_0( h_12 : Header_0,  seams_2 : vec2<u32>) -> vec2<u32>
{
    var own_0 : vec2<u32> = ((((mask_below_0(h_12.references_1)) & ((~h_12.foreign_refs_1)))) | (seams_2));
    var _S69 : vec2<u32> = mask_shl1_0((own_0 & ((~h_12.loop_ends_2))));
    var rest_3 : vec2<u32> = h_12.loop_ends_2;
    var before_2 : vec2<u32> = _S69;
    var first_1 : u32 = u32(0);
    for(;;)
    {
        if(mask_any_0(rest_3))
        {
        }
        else
        {
            break;
        }
        var last_0 : u32 = mask_lsb_0(rest_3);
        if(mask_test_0(own_0, last_0))
        {
            before_2 = (before_2 | ((mask_bit_0(first_1))));
        }
        var _S70 : u32 = last_0 + u32(1);
        rest_3 = mask_clear_lsb_0(rest_3);
        first_1 = _S70;
    }
    return (own_0 & (before_2));
}

fn anchors_of_0( h_13 : Header_0,  s_8 : u32,  count_2 : u32) -> u32
{
    var _S71 : bool;
    if((h_13.references_1) == u32(0))
    {
        _S71 = true;
    }
    else
    {
        if(s_8 > u32(0))
        {
            _S71 = (((h_13.flags_0) & (u32(4)))) == u32(0);
        }
        else
        {
            _S71 = false;
        }
    }
    if(_S71)
    {
        return count_2;
    }
    return mask_count_0(stored_corners_0(h_13, seam_references_0(h_13, s_8)));
}

fn anchor_widths_0( s_9 : u32,  p_7 : u32) -> u32
{
    var n_5 : u32 = (extractBits((group_stream_0[s_9]), u32((i32(0))), u32((i32(3)))));
    var _S72 : u32 = (extractBits((group_stream_0[s_9]), u32((i32(3))), u32((i32(6)))));
    var _S73 : u32 = load_bits_0(p_7, u32(3) * n_5);
    var c_0 : u32 = u32(0);
    var widths_0 : u32 = u32(0);
    for(;;)
    {
        if(c_0 < n_5)
        {
        }
        else
        {
            break;
        }
        var field_4 : u32 = (extractBits((_S73), u32((i32(u32(3) * c_0))), u32((i32(3)))));
        var width_0 : u32;
        if(field_4 == u32(7))
        {
            width_0 = _S72;
        }
        else
        {
            var _S74 : u32 = (extractBits((group_bases_0[s_9]), u32((i32(16))), u32((i32(5)))));
            width_0 = min(_S74 + field_4, _S72);
        }
        var widths_1 : u32 = (widths_0 | (((width_0 << ((u32(6) * c_0))))));
        c_0 = c_0 + u32(1);
        widths_0 = widths_1;
    }
    return widths_0;
}

fn further_widths_0( p_8 : u32,  s_10 : u32,  count_3 : u32) -> u32
{
    var n_6 : u32 = (extractBits((group_stream_0[s_10]), u32((i32(0))), u32((i32(3)))));
    var _S75 : u32;
    if(count_3 > u32(1))
    {
        var _S76 : u32 = (extractBits((group_stream_0[s_10]), u32((i32(3))), u32((i32(6)))));
        var _S77 : u32 = anchor_widths_0(s_10, p_8 + n_6 * _S76);
        _S75 = _S77;
    }
    else
    {
        _S75 = u32(0);
    }
    return _S75;
}

fn width_sum_0( widths_2 : u32) -> u32
{
    return ((widths_2 & (u32(63)))) + ((((widths_2 >> (u32(6)))) & (u32(63)))) + ((((widths_2 >> (u32(12)))) & (u32(63)))) + ((widths_2 >> (u32(18))));
}

fn after_anchors_0( p_9 : u32,  s_11 : u32,  count_4 : u32,  widths_3 : u32) -> u32
{
    var n_7 : u32 = (extractBits((group_stream_0[s_11]), u32((i32(0))), u32((i32(3)))));
    var _S78 : u32;
    if(count_4 > u32(0))
    {
        var _S79 : u32 = (extractBits((group_stream_0[s_11]), u32((i32(3))), u32((i32(6)))));
        _S78 = p_9 + n_7 * _S79;
    }
    else
    {
        _S78 = p_9;
    }
    if(count_4 > u32(1))
    {
        _S78 = _S78 + (u32(3) * n_7 + (count_4 - u32(1)) * width_sum_0(widths_3));
    }
    return _S78;
}

fn width_field_0( position_0 : u32) -> u32
{
    var w_0 : u32 = load_bits_0(position_0, u32(5));
    var _S80 : u32;
    if(w_0 == u32(31))
    {
        _S80 = u32(32);
    }
    else
    {
        _S80 = w_0;
    }
    return _S80;
}

fn fixed_width_0( elements_0 : u32,  widths_4 : u32) -> u32
{
    var c_1 : u32 = u32(0);
    var sum_0 : u32 = u32(0);
    for(;;)
    {
        if(c_1 < elements_0)
        {
        }
        else
        {
            break;
        }
        var sum_1 : u32 = sum_0 + width_field_0(widths_4 + u32(5) * c_1);
        c_1 = c_1 + u32(1);
        sum_0 = sum_1;
    }
    return sum_0;
}

fn low_width_0( code_0 : u32,  elements_1 : u32,  widths_5 : u32) -> u32
{
    var _S81 : u32;
    if(code_0 == u32(255))
    {
        _S81 = fixed_width_0(elements_1, widths_5);
    }
    else
    {
        _S81 = code_0 * elements_1;
    }
    return _S81;
}

fn length_of_0( r_5 : u32) -> u32
{
    return group_lengths_0[member_0 * u32(64) + ((r_5 & (u32(63))))];
}

fn id_at_0( rank_0 : u32) -> u32
{
    return nth_bit_0(the_boundary_0, rank_0);
}

fn waiting_vertices_0( h_14 : Header_0) -> vec2<u32>
{
    var _S82 : vec2<u32> = mask_none_0();
    var waiting_1 : vec2<u32>;
    var r_6 : u32;
    if((h_14.references_1) == u32(0))
    {
        waiting_1 = the_boundary_0;
        r_6 = u32(0);
        for(;;)
        {
            if(r_6 < (mask_count_0(the_starts_0)))
            {
            }
            else
            {
                break;
            }
            var _S83 : vec2<u32> = (waiting_1 & ((~mask_bit_0(((ids_before_0(r_6)) & (u32(63)))))));
            var _S84 : u32 = r_6 + u32(1);
            waiting_1 = _S83;
            r_6 = _S84;
        }
    }
    else
    {
        waiting_1 = _S82;
    }
    r_6 = u32(0);
    var rank_1 : u32 = u32(0);
    for(;;)
    {
        var _S85 : bool;
        if(r_6 < (h_14.references_1))
        {
            _S85 = mask_any_0(h_14.private_refs_1);
        }
        else
        {
            _S85 = false;
        }
        if(_S85)
        {
        }
        else
        {
            break;
        }
        var i_8 : u32 = u32(1);
        for(;;)
        {
            var _S86 : bool;
            if(i_8 < (length_of_0(r_6)))
            {
                _S86 = mask_test_0(h_14.private_refs_1, r_6);
            }
            else
            {
                _S86 = false;
            }
            if(_S86)
            {
            }
            else
            {
                break;
            }
            var _S87 : vec2<u32> = (waiting_1 | ((mask_bit_0(id_at_0(rank_1 + i_8)))));
            var _S88 : u32 = i_8 + u32(1);
            waiting_1 = _S87;
            i_8 = _S88;
        }
        var rank_2 : u32 = rank_1 + length_of_0(r_6);
        r_6 = r_6 + u32(1);
        rank_1 = rank_2;
    }
    return waiting_1;
}

fn after_ones_0( p_10 : u32,  n_8 : u32) -> u32
{
    if(n_8 == u32(0))
    {
        return p_10;
    }
    var w_1 : u32 = (p_10 >> (u32(5)));
    var word_1 : u32 = ((load_word_0(w_1)) & ((~word_below_0((p_10 & (u32(31)))))));
    var ones_1 : u32 = countOneBits(word_1);
    var empty_0 : u32 = u32(0);
    var _S89 : u32 = n_8;
    var w_2 : u32 = w_1;
    var word_2 : u32 = word_1;
    for(;;)
    {
        if(ones_1 < _S89)
        {
        }
        else
        {
            break;
        }
        if(ones_1 == u32(0))
        {
            empty_0 = empty_0 + u32(1);
        }
        else
        {
            empty_0 = u32(0);
        }
        var _S90 : bool;
        if(w_2 >= (push_0.blob_words_0))
        {
            _S90 = true;
        }
        else
        {
            _S90 = empty_0 > u32(512);
        }
        if(_S90)
        {
            error_0 = u32(8);
            return p_10;
        }
        var _S91 : u32 = _S89 - ones_1;
        var w_3 : u32 = w_2 + u32(1);
        var word_3 : u32 = load_word_0(w_3);
        ones_1 = countOneBits(word_3);
        _S89 = _S91;
        w_2 = w_3;
        word_2 = word_3;
    }
    ones_1 = _S89;
    for(;;)
    {
        if(ones_1 > u32(1))
        {
        }
        else
        {
            break;
        }
        var word_4 : u32 = (word_2 & ((word_2 - u32(1))));
        ones_1 = ones_1 - u32(1);
        word_2 = word_4;
    }
    return ((w_2 << (u32(5)))) + firstbitlow_0(word_2) + u32(1);
}

fn place_sections_0( h_15 : Header_0,  live_0 : bool)
{
    var _S92 : bool = mask_any_0(h_15.owned_refs_0);
    var _S93 : u32 = chain_vertices_0(h_15, u32(64)).x;
    var p_11 : u32 = anchors_begin_0(h_15);
    var codes_2 : u32 = h_15.codes_1;
    var _S94 : u32 = mask_count_0(the_starts_0);
    all_places_0[job_place_0].anchors_0 = p_11;
    var count_5 : u32 = _S94;
    var p_12 : u32 = p_11;
    var s_12 : u32 = u32(0);
    var low_2 : u32 = u32(0);
    var ones_2 : u32 = u32(0);
    for(;;)
    {
        if(s_12 < stream_total_0)
        {
        }
        else
        {
            break;
        }
        var count_6 : u32 = anchors_of_0(h_15, s_12, count_5);
        var _S95 : u32 = further_widths_0(p_12, s_12, count_6);
        var _S96 : u32 = after_anchors_0(p_12, s_12, count_6, _S95);
        if(!_S92)
        {
            var _S97 : u32 = s_12 + u32(1);
            count_5 = count_6;
            p_12 = _S96;
            s_12 = _S97;
            continue;
        }
        var n_9 : u32 = (extractBits((group_stream_0[s_12]), u32((i32(0))), u32((i32(3)))));
        var code_1 : u32 = code_at_1(&(codes_2), s_12, true);
        var low_3 : u32 = low_2 + _S93 * low_width_0(code_1, n_9, codes_2 - u32(5) * n_9);
        var ones_3 : u32;
        if(code_1 != u32(255))
        {
            ones_3 = ones_2 + _S93 * n_9;
        }
        else
        {
            ones_3 = ones_2;
        }
        var _S98 : u32 = code_at_1(&(codes_2), s_12, false);
        low_2 = low_3;
        ones_2 = ones_3;
        var _S97 : u32 = s_12 + u32(1);
        count_5 = count_6;
        p_12 = _S96;
        s_12 = _S97;
    }
    all_places_0[job_place_0].chains_0 = p_12;
    if(error_0 == u32(0))
    {
        count_5 = p_12 + low_2;
    }
    else
    {
        count_5 = u32(4294967295);
    }
    all_places_0[job_place_0].quotients_0 = count_5;
    var _S99 : vec2<u32>;
    if(live_0)
    {
        _S99 = waiting_vertices_0(h_15);
    }
    else
    {
        _S99 = mask_none_0();
    }
    all_places_0[job_place_0].waiting_0 = _S99;
    var interior_1 : u32 = after_ones_0(p_12 + low_2, ones_2);
    if(error_0 == u32(0))
    {
        count_5 = interior_1;
    }
    else
    {
        count_5 = u32(4294967295);
    }
    all_places_0[job_place_0].interior_0 = count_5;
    return;
}

fn mask_msb_0( m_8 : vec2<u32>) -> u32
{
    var _S100 : u32 = m_8.y;
    var _S101 : u32;
    if(_S100 != u32(0))
    {
        _S101 = u32(32) + firstbithigh_0(_S100);
    }
    else
    {
        var _S102 : u32 = m_8.x;
        if(_S102 != u32(0))
        {
            _S101 = firstbithigh_0(_S102);
        }
        else
        {
            _S101 = u32(64);
        }
    }
    return _S101;
}

fn loop_begin_0( h_16 : Header_0,  r_7 : u32) -> u32
{
    var before_3 : vec2<u32> = ((h_16.loop_ends_2) & ((mask_below_0(r_7))));
    var _S103 : u32;
    if(mask_any_0(before_3))
    {
        _S103 = mask_msb_0(before_3) + u32(1);
    }
    else
    {
        _S103 = u32(0);
    }
    return _S103;
}

fn check_length_0( h_17 : Header_0,  r_8 : u32,  rank_3 : u32)
{
    var loop_1 : vec2<u32> = loop_of_0(h_17, r_8);
    var end_1 : u32 = rank_3 + length_of_0(r_8);
    if(end_1 == rank_3)
    {
        error_0 = u32(4);
    }
    var _S104 : bool;
    if(r_8 == (loop_begin_0(h_17, r_8)))
    {
        _S104 = rank_3 != (loop_1.x);
    }
    else
    {
        _S104 = false;
    }
    if(_S104)
    {
        error_0 = u32(4);
    }
    if(mask_test_0(h_17.loop_ends_2, r_8))
    {
        _S104 = end_1 != (loop_1.y);
    }
    else
    {
        _S104 = end_1 > (loop_1.y);
    }
    if(_S104)
    {
        error_0 = u32(4);
    }
    return;
}

fn place_references_0( h_18 : Header_0,  references_2 : u32)
{
    var begins_0 : vec2<u32> = mask_none_0();
    var r_9 : u32 = u32(0);
    var rank_4 : u32 = u32(0);
    for(;;)
    {
        if(r_9 < references_2)
        {
        }
        else
        {
            break;
        }
        var _S105 : vec2<u32> = (begins_0 | ((mask_bit_0((rank_4 & (u32(63)))))));
        var rank_5 : u32 = rank_4 + length_of_0(r_9);
        var _S106 : u32 = r_9 + u32(1);
        begins_0 = _S105;
        r_9 = _S106;
        rank_4 = rank_5;
    }
    connectivity_0[job_place_0].references_0 = begins_0;
    return;
}

fn close_pass_0()
{
    if(error_0 != u32(0))
    {
        var _S107 : u32 = atomicOr(&(the_summaries_0[job_place_0]), (error_0 << (u32(16))));
    }
    return;
}

@compute
@workgroup_size(64, 1, 1)
fn main(@builtin(local_invocation_index) gl_LocalInvocationIndex_0 : u32, @builtin(workgroup_id) gl_WorkGroupID_0 : vec3<u32>)
{
    _S3 = gl_LocalInvocationIndex_0;
    _S4 = gl_WorkGroupID_0;
    var live_1 : bool = open_pass_0();
    var h_19 : Header_0 = open_header_0();
    var header_error_0 : u32 = error_0;
    var references_3 : u32;
    if(live_1)
    {
        references_3 = h_19.references_1;
    }
    else
    {
        references_3 = u32(0);
    }
    var r_10 : u32 = part_0;
    for(;;)
    {
        if(r_10 < references_3)
        {
        }
        else
        {
            break;
        }
        var _S108 : u32 = measured_length_0(h_19, r_10);
        group_lengths_0[member_0 * u32(64) + r_10] = min(_S108, u32(64));
        r_10 = r_10 + u32(8);
    }
    workgroupBarrier();
    var _S109 : bool;
    if(present_0)
    {
        _S109 = part_0 == u32(7);
    }
    else
    {
        _S109 = false;
    }
    if(_S109)
    {
        var lengths_error_0 : u32 = error_0;
        error_0 = header_error_0;
        place_sections_0(h_19, live_1);
        if(error_0 == u32(0))
        {
            error_0 = lengths_error_0;
        }
    }
    if(!live_1)
    {
        return;
    }
    if(references_3 > u32(0))
    {
        _S109 = (mask_count_0(h_19.loop_ends_2)) != (mask_count_0(the_starts_0));
    }
    else
    {
        _S109 = false;
    }
    if(_S109)
    {
        error_0 = u32(4);
    }
    r_10 = part_0;
    for(;;)
    {
        if(r_10 < references_3)
        {
            _S109 = error_0 == u32(0);
        }
        else
        {
            _S109 = false;
        }
        if(_S109)
        {
        }
        else
        {
            break;
        }
        var before_4 : u32 = u32(0);
        var rank_6 : u32 = u32(0);
        for(;;)
        {
            if(before_4 < r_10)
            {
            }
            else
            {
                break;
            }
            var rank_7 : u32 = rank_6 + length_of_0(before_4);
            before_4 = before_4 + u32(1);
            rank_6 = rank_7;
        }
        check_length_0(h_19, r_10, rank_6);
        r_10 = r_10 + u32(8);
    }
    if(part_0 == u32(0))
    {
        place_references_0(h_19, references_3);
    }
    close_pass_0();
    return;
}

