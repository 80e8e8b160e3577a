// Translated from shaders/decoders/lengths.comp, shaders/decoders/corners.comp, shaders/decoders/chains.comp, shaders/decoders/traversal.comp, shaders/decoders/geo.comp by tools/build_wgsl.py: do not edit.
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

@binding(4) @group(0) var<storage, read_write> all_values_0 : array<u32>;

@binding(3) @group(0) var<storage, read_write> all_triangles_0 : array<u32>;

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

var<private> member_0 : u32;

var<private> first_item_0 : u32;

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
    var _S3 : u32 = ((((load_word_0(u32(1))) >> (u32(8)))) & (u32(255)));
    stream_total_0 = _S3;
    meshlet_total_0 = load_word_0(u32(4));
    byte_length_0 = load_word_0(u32(5));
    group_table_0 = u32(8) + u32(7) * _S3;
    return;
}

var<private> stream_end_0 : u32;

var<workgroup> shared_stream_0 : array<u32, i32(64)>;

var<workgroup> shared_bases_0 : array<u32, i32(64)>;

fn share_streams_0( end_0 : u32)
{
    load_tables_0();
    var _S4 : u32 = min(stream_total_0, u32(64));
    stream_total_0 = _S4;
    stream_end_0 = min(end_0, _S4);
    var s_0 : u32 = the_thread_0;
    for(;;)
    {
        if(s_0 < stream_total_0)
        {
        }
        else
        {
            break;
        }
        var _S5 : u32 = u32(7) * s_0;
        var shape_0 : u32 = load_word_0(u32(8) + _S5);
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
        shared_stream_0[s_0] = (((((((((shape_0 >> (u32(8)))) & (u32(7)))) | (((((((shape_0 >> (u32(16)))) & (u32(63)))) << (u32(3))))))) | (((((((shape_0 >> (u32(24)))) & (u32(7)))) << (u32(9))))))) | ((((min(element_0, u32(256))) << (u32(12))))));
        shared_bases_0[s_0] = load_word_0(u32(9) + _S5);
        s_0 = s_0 + u32(64);
    }
    workgroupBarrier();
    return;
}

fn field_of_0( s_1 : u32) -> u32
{
    var bits_0 : u32 = (extractBits((shared_stream_0[s_1]), u32((i32(3))), u32((i32(6)))));
    var field_1 : u32;
    if(s_1 == u32(0))
    {
        field_1 = max(bits_0, u32(21));
    }
    else
    {
        field_1 = bits_0;
    }
    var _S6 : u32 = (extractBits((shared_stream_0[s_1]), u32((i32(0))), u32((i32(3)))));
    if((field_1 * _S6) <= u32(64))
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
    var _S7 : u32 = field_of_0(s_2);
    var _S8 : u32 = (extractBits((shared_stream_0[s_2]), u32((i32(0))), u32((i32(3)))));
    return ((_S7 * _S8 + u32(31)) >> (u32(5)));
}

fn value_place_0( s_3 : u32) -> vec2<u32>
{
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
        var _S9 : u32 = words_of_0(before_1);
        var words_1 : u32 = words_0 + _S9;
        before_1 = before_1 + u32(1);
        words_0 = words_1;
    }
    var _S10 : u32 = u32(64) * words_0;
    var _S11 : u32 = words_of_0(s_3);
    return vec2<u32>(_S10, _S11);
}

var<workgroup> shared_places_0 : array<u32, i32(64)>;

fn share_value_places_0()
{
    var s_4 : u32 = the_thread_0;
    for(;;)
    {
        if(s_4 < stream_total_0)
        {
        }
        else
        {
            break;
        }
        var place_0 : vec2<u32> = value_place_0(s_4);
        var _S12 : u32 = ((((place_0.x) & (u32(65535)))) | ((((((place_0.y) & (u32(63)))) << (u32(16))))));
        var _S13 : u32 = field_of_0(s_4);
        var _S14 : u32 = (_S12 | (((_S13 << (u32(22))))));
        var _S15 : u32 = words_of_0(s_4);
        shared_places_0[s_4] = (_S14 | ((((min(_S15, u32(3))) << (u32(28))))));
        s_4 = s_4 + u32(64);
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

fn open_pass_0( threads_0 : u32) -> bool
{
    var _S16 : u32 = the_thread_0 / threads_0;
    member_0 = _S16;
    var _S17 : u32 = the_thread_0 % threads_0;
    first_item_0 = _S17;
    var _S18 : u32 = push_0.first_0;
    var _S19 : u32 = the_workgroup_0.x;
    var _S20 : u32 = u32(64) / threads_0;
    var number_0 : u32 = _S18 + _S19 * _S20 + member_0;
    open_job_0(min(number_0, push_0.meshlets_0 - u32(1)));
    share_streams_0(job_streams_0());
    share_value_places_0();
    the_values_0 = job_values_0();
    the_boundary_0 = connectivity_0[job_place_0].boundary_0;
    the_starts_0 = connectivity_0[job_place_0].starts_0;
    the_references_0 = connectivity_0[job_place_0].references_0;
    symbol_c_0 = connectivity_0[job_place_0].closing_0;
    symbol_e_0 = connectivity_0[job_place_0].ends_0;
    symbol_s_0 = connectivity_0[job_place_0].splits_0;
    error_0 = u32(0);
    var summary_0 : u32 = atomicLoad(&(the_summaries_0[job_place_0]));
    var _S21 : bool = number_0 < (push_0.meshlets_0);
    present_0 = _S21;
    var _S22 : bool;
    if(_S21)
    {
        _S22 = ((summary_0 >> (u32(16)))) == u32(0);
    }
    else
    {
        _S22 = false;
    }
    return _S22;
}

fn word_below_0( n_0 : u32) -> u32
{
    var _S23 : u32;
    if(n_0 >= u32(32))
    {
        _S23 = u32(4294967295);
    }
    else
    {
        _S23 = ((u32(1) << (n_0))) - u32(1);
    }
    return _S23;
}

fn mask_below_0( n_1 : u32) -> vec2<u32>
{
    var _S24 : u32 = word_below_0(n_1);
    var _S25 : u32;
    if(n_1 <= u32(32))
    {
        _S25 = u32(0);
    }
    else
    {
        _S25 = word_below_0(n_1 - u32(32));
    }
    return vec2<u32>(_S24, _S25);
}

fn mask_shl1_0( m_0 : vec2<u32>) -> vec2<u32>
{
    var _S26 : u32 = m_0.x;
    return vec2<u32>((_S26 << (u32(1))), ((((m_0.y) << (u32(1)))) | (((_S26 >> (u32(31)))))));
}

fn mask_bit_0( i_3 : u32) -> vec2<u32>
{
    var _S27 : vec2<u32>;
    if(((i_3 & (u32(32)))) == u32(0))
    {
        _S27 = vec2<u32>((u32(1) << (((i_3 & (u32(31)))))), u32(0));
    }
    else
    {
        _S27 = vec2<u32>(u32(0), (u32(1) << (((i_3 & (u32(31)))))));
    }
    return _S27;
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
    var _S28 : u32 = (extractBits((places_0.counts_0), u32((i32(0))), u32((i32(7)))));
    h_0.triangles_0 = _S28;
    var _S29 : u32 = (extractBits((places_0.counts_0), u32((i32(7))), u32((i32(6)))));
    h_0.references_1 = _S29;
    var _S30 : u32 = (extractBits((places_0.counts_0), u32((i32(13))), u32((i32(3)))));
    h_0.flags_0 = _S30;
    var _S31 : u32 = (extractBits((places_0.counts_0), u32((i32(16))), u32((i32(3)))));
    h_0.length_width_0 = _S31;
    var _S32 : u32 = (extractBits((places_0.counts_0), u32((i32(19))), u32((i32(5)))));
    h_0.delta_width_0 = _S32;
    var _S33 : u32 = (extractBits((places_0.counts_0), u32((i32(24))), u32((i32(3)))));
    h_0.slot_width_0 = _S33;
    var _S34 : u32 = _S32 + _S33;
    var _S35 : u32;
    if(((_S30 & (u32(4)))) != u32(0))
    {
        _S35 = stream_total_0 - u32(1);
    }
    else
    {
        _S35 = u32(0);
    }
    h_0.entry_width_0 = _S34 + _S35;
    h_0.lengths_1 = places_0.lengths_0;
    h_0.entries_1 = places_0.entries_0;
    h_0.codes_1 = places_0.codes_0;
    h_0.foreign_refs_1 = places_0.foreign_refs_0;
    h_0.private_refs_1 = places_0.private_refs_0;
    h_0.loop_ends_2 = places_0.loop_ends_0;
    var _S36 : vec2<u32> = ((mask_below_0(h_0.references_1)) & ((~(((places_0.foreign_refs_0) | ((places_0.private_refs_0)))))));
    h_0.owned_refs_0 = _S36;
    h_0.sized_refs_0 = (_S36 | ((((places_0.private_refs_0) & ((~lone_references_0(places_0.loop_ends_0)))))));
    return h_0;
}

var<private> triangle_count_0 : u32;

fn open_header_0() -> Header_0
{
    var h_1 : Header_0 = header_of_0(job_meshlet_0);
    triangle_count_0 = h_1.triangles_0;
    return h_1;
}

var<workgroup> shared_lengths_0 : array<u32, i32(512)>;

fn mask_test_0( m_2 : vec2<u32>,  i_4 : u32) -> bool
{
    var _S37 : u32;
    if(((i_4 & (u32(32)))) == u32(0))
    {
        _S37 = m_2.x;
    }
    else
    {
        _S37 = m_2.y;
    }
    return ((((_S37 >> (((i_4 & (u32(31))))))) & (u32(1)))) != u32(0);
}

fn mask_count_0( m_3 : vec2<u32>) -> u32
{
    return countOneBits(m_3.x) + countOneBits(m_3.y);
}

fn nth_bit_0( m_4 : vec2<u32>,  n_2 : u32) -> u32
{
    var _S38 : u32 = m_4.x;
    var low_0 : u32 = countOneBits(_S38);
    var _S39 : bool = n_2 < low_0;
    var half_width_0 : u32;
    if(_S39)
    {
        half_width_0 = u32(0);
    }
    else
    {
        half_width_0 = u32(32);
    }
    var word_0 : u32;
    if(_S39)
    {
        word_0 = _S38;
    }
    else
    {
        word_0 = m_4.y;
    }
    var _S40 : u32;
    if(n_2 >= low_0)
    {
        _S40 = n_2 - low_0;
    }
    else
    {
        _S40 = n_2;
    }
    var _S41 : u32 = half_width_0;
    half_width_0 = u32(16);
    var at_0 : u32 = _S41;
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
        if(_S40 >= ones_0)
        {
            var _S42 : u32 = _S40 - ones_0;
            var at_1 : u32 = at_0 + half_width_0;
            word_0 = (word_0 >> (half_width_0));
            _S40 = _S42;
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
    var _S43 : bool = delta_0 > (h_5.meshlet_0);
    if(_S43)
    {
        error_0 = u32(5);
    }
    var _S44 : u32;
    if(_S43)
    {
        _S44 = u32(0);
    }
    else
    {
        _S44 = h_5.meshlet_0 - delta_0;
    }
    return _S44;
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
    var _S45 : u32 = m_6.x;
    var _S46 : vec2<u32>;
    if(_S45 != u32(0))
    {
        _S46 = vec2<u32>((_S45 & ((_S45 - u32(1)))), m_6.y);
    }
    else
    {
        var _S47 : u32 = m_6.y;
        _S46 = vec2<u32>(u32(0), (_S47 & ((_S47 - u32(1)))));
    }
    return _S46;
}

fn mask_lsb_0( m_7 : vec2<u32>) -> u32
{
    var _S48 : u32 = m_7.x;
    var _S49 : u32;
    if(_S48 != u32(0))
    {
        _S49 = firstbitlow_0(_S48);
    }
    else
    {
        var _S50 : u32 = m_7.y;
        if(_S50 != u32(0))
        {
            _S49 = u32(32) + firstbitlow_0(_S50);
        }
        else
        {
            _S49 = u32(64);
        }
    }
    return _S49;
}

fn slot_reference_0( h_7 : Header_0,  slot_0 : u32) -> u32
{
    var rest_0 : vec2<u32> = h_7.owned_refs_0;
    var i_6 : u32 = u32(0);
    for(;;)
    {
        var _S51 : bool;
        if(i_6 < slot_0)
        {
            _S51 = mask_any_0(rest_0);
        }
        else
        {
            _S51 = false;
        }
        if(_S51)
        {
        }
        else
        {
            break;
        }
        var _S52 : vec2<u32> = mask_clear_lsb_0(rest_0);
        var _S53 : u32 = i_6 + u32(1);
        rest_0 = _S52;
        i_6 = _S53;
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
    var _S54 : u32 = entry_owner_0(h_8, entry_2);
    var owner_0 : Header_0 = header_of_0(_S54);
    var _S55 : u32 = slot_reference_0(owner_0, entry_slot_0(h_8, entry_2));
    return stored_length_0(owner_0, (_S55 & (u32(63))));
}

fn load_words3_0( i_7 : u32) -> vec3<u32>
{
    return vec3<u32>(load_memory_0(i_7), load_memory_0(i_7 + u32(1)), load_memory_0(i_7 + u32(2)));
}

fn load_mask_0( p_1 : u32,  n_4 : u32) -> vec2<u32>
{
    var words_3 : vec3<u32> = load_words3_0((p_1 >> (u32(5))));
    var _S56 : u32 = words_3.y;
    var _S57 : u32 = (p_1 & (u32(31)));
    return (vec2<u32>(funnel_0(words_3.x, _S56, _S57), funnel_0(_S56, words_3.z, _S57)) & ((mask_below_0(n_4))));
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
    var _S58 : vec2<u32> = vec2<u32>(u32(0));
    var _S59 : vec2<u32> = load_mask_0(h_9.lengths_1, u32(64));
    var rest_1 : vec2<u32> = h_9.sized_refs_0;
    var window_0 : vec2<u32> = _S59;
    var used_0 : u32 = u32(0);
    var p_2 : u32 = h_9.lengths_1;
    var count_0 : vec2<u32> = _S58;
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
        var _S60 : u32;
        if(r_4 < reference_0)
        {
            _S60 = inner_0;
        }
        else
        {
            _S60 = u32(0);
        }
        var count_1 : vec2<u32> = count_0 + vec2<u32>(inner_0, _S60);
        var used_2 : u32 = used_1 + h_9.length_width_0;
        rest_1 = mask_clear_lsb_0(rest_1);
        used_0 = used_2;
        count_0 = count_1;
    }
    return count_0;
}

fn code_at_0( p_4 : ptr<function, u32>,  s_5 : u32,  of_chains_0 : bool) -> u32
{
    var field_2 : u32 = load_bits_0((*p_4), u32(3));
    (*p_4) = (*p_4) + u32(3);
    if(field_2 == u32(7))
    {
        var _S61 : u32 = (extractBits((shared_stream_0[s_5]), u32((i32(0))), u32((i32(3)))));
        (*p_4) = (*p_4) + u32(5) * _S61;
        return u32(255);
    }
    var base_1 : u32;
    if(of_chains_0)
    {
        var _S62 : u32 = (extractBits((shared_bases_0[s_5]), u32((i32(0))), u32((i32(5)))));
        base_1 = _S62;
    }
    else
    {
        var _S63 : u32 = (extractBits((shared_bases_0[s_5]), u32((i32(8))), u32((i32(5)))));
        base_1 = _S63;
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
    var _S64 : u32 = (k_2 & (u32(31)));
    if(rice_0)
    {
        base_1 = u32(0);
    }
    else
    {
        base_1 = u32(32);
    }
    return (_S64 | (base_1));
}

fn code_at_1( p_5 : ptr<function, u32>,  s_6 : u32,  of_chains_1 : bool) -> u32
{
    var field_3 : u32 = load_bits_0((*p_5), u32(3));
    (*p_5) = (*p_5) + u32(3);
    if(field_3 == u32(7))
    {
        var _S65 : u32 = (extractBits((shared_stream_0[s_6]), u32((i32(0))), u32((i32(3)))));
        (*p_5) = (*p_5) + u32(5) * _S65;
        return u32(255);
    }
    var base_2 : u32;
    if(of_chains_1)
    {
        var _S66 : u32 = (extractBits((shared_bases_0[s_6]), u32((i32(0))), u32((i32(5)))));
        base_2 = _S66;
    }
    else
    {
        var _S67 : u32 = (extractBits((shared_bases_0[s_6]), u32((i32(8))), u32((i32(5)))));
        base_2 = _S67;
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
    var _S68 : u32 = (k_3 & (u32(31)));
    if(rice_1)
    {
        base_2 = u32(0);
    }
    else
    {
        base_2 = u32(32);
    }
    return (_S68 | (base_2));
}

fn code_at_2( p_6 : ptr<function, u32>,  s_7 : u32,  of_chains_2 : bool) -> u32
{
    var field_4 : u32 = load_bits_0((*p_6), u32(3));
    (*p_6) = (*p_6) + u32(3);
    if(field_4 == u32(7))
    {
        var _S69 : u32 = (extractBits((shared_stream_0[s_7]), u32((i32(0))), u32((i32(3)))));
        (*p_6) = (*p_6) + u32(5) * _S69;
        return u32(255);
    }
    var base_3 : u32;
    if(of_chains_2)
    {
        var _S70 : u32 = (extractBits((shared_bases_0[s_7]), u32((i32(0))), u32((i32(5)))));
        base_3 = _S70;
    }
    else
    {
        var _S71 : u32 = (extractBits((shared_bases_0[s_7]), u32((i32(8))), u32((i32(5)))));
        base_3 = _S71;
    }
    var rice_2 : bool;
    if(of_chains_2)
    {
        rice_2 = true;
    }
    else
    {
        rice_2 = field_4 < u32(4);
    }
    var k_4 : u32;
    if(rice_2)
    {
        k_4 = base_3 + field_4;
    }
    else
    {
        k_4 = max(base_3, u32(1)) - u32(1) + field_4 - u32(4);
    }
    if(k_4 > u32(31))
    {
        error_0 = u32(7);
    }
    var _S72 : u32 = (k_4 & (u32(31)));
    if(rice_2)
    {
        base_3 = u32(0);
    }
    else
    {
        base_3 = u32(32);
    }
    return (_S72 | (base_3));
}

fn anchors_begin_0( h_10 : Header_0) -> u32
{
    var p_7 : u32 = h_10.codes_1;
    var _S73 : bool = mask_any_0(h_10.owned_refs_0);
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
        if(_S73)
        {
            var _S74 : u32 = code_at_0(&(p_7), s_8, true);
        }
        var _S75 : u32 = code_at_0(&(p_7), s_8, false);
        s_8 = s_8 + u32(1);
    }
    return p_7;
}

fn mask_none_0() -> vec2<u32>
{
    return vec2<u32>(u32(0));
}

fn seam_references_0( h_11 : Header_0,  s_9 : u32) -> vec2<u32>
{
    var seams_0 : vec2<u32> = mask_none_0();
    var _S76 : bool;
    if(s_9 == u32(0))
    {
        _S76 = true;
    }
    else
    {
        _S76 = (((h_11.flags_0) & (u32(4)))) == u32(0);
    }
    if(_S76)
    {
        return seams_0;
    }
    var _S77 : u32 = h_11.entries_1 + h_11.delta_width_0 + h_11.slot_width_0 + s_9 - u32(1);
    var rest_2 : vec2<u32> = h_11.foreign_refs_1;
    var seams_1 : vec2<u32> = seams_0;
    var share_0 : u32 = _S77;
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
    var _S78 : vec2<u32> = mask_shl1_0((own_0 & ((~h_12.loop_ends_2))));
    var rest_3 : vec2<u32> = h_12.loop_ends_2;
    var before_2 : vec2<u32> = _S78;
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
        var _S79 : u32 = last_0 + u32(1);
        rest_3 = mask_clear_lsb_0(rest_3);
        first_1 = _S79;
    }
    return (own_0 & (before_2));
}

fn anchors_of_0( h_13 : Header_0,  s_10 : u32,  count_2 : u32) -> u32
{
    var _S80 : bool;
    if((h_13.references_1) == u32(0))
    {
        _S80 = true;
    }
    else
    {
        if(s_10 > u32(0))
        {
            _S80 = (((h_13.flags_0) & (u32(4)))) == u32(0);
        }
        else
        {
            _S80 = false;
        }
    }
    if(_S80)
    {
        return count_2;
    }
    return mask_count_0(stored_corners_0(h_13, seam_references_0(h_13, s_10)));
}

fn anchor_widths_0( s_11 : u32,  p_8 : u32) -> u32
{
    var n_5 : u32 = (extractBits((shared_stream_0[s_11]), u32((i32(0))), u32((i32(3)))));
    var _S81 : u32 = (extractBits((shared_stream_0[s_11]), u32((i32(3))), u32((i32(6)))));
    var _S82 : u32 = load_bits_0(p_8, u32(3) * n_5);
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
        var field_5 : u32 = (extractBits((_S82), u32((i32(u32(3) * c_0))), u32((i32(3)))));
        var width_0 : u32;
        if(field_5 == u32(7))
        {
            width_0 = _S81;
        }
        else
        {
            var _S83 : u32 = (extractBits((shared_bases_0[s_11]), u32((i32(16))), u32((i32(5)))));
            width_0 = min(_S83 + field_5, _S81);
        }
        var widths_1 : u32 = (widths_0 | (((width_0 << ((u32(6) * c_0))))));
        c_0 = c_0 + u32(1);
        widths_0 = widths_1;
    }
    return widths_0;
}

fn further_widths_0( p_9 : u32,  s_12 : u32,  count_3 : u32) -> u32
{
    var n_6 : u32 = (extractBits((shared_stream_0[s_12]), u32((i32(0))), u32((i32(3)))));
    var _S84 : u32;
    if(count_3 > u32(1))
    {
        var _S85 : u32 = (extractBits((shared_stream_0[s_12]), u32((i32(3))), u32((i32(6)))));
        var _S86 : u32 = anchor_widths_0(s_12, p_9 + n_6 * _S85);
        _S84 = _S86;
    }
    else
    {
        _S84 = u32(0);
    }
    return _S84;
}

fn width_sum_0( widths_2 : u32) -> u32
{
    return ((widths_2 & (u32(63)))) + ((((widths_2 >> (u32(6)))) & (u32(63)))) + ((((widths_2 >> (u32(12)))) & (u32(63)))) + ((widths_2 >> (u32(18))));
}

fn after_anchors_0( p_10 : u32,  s_13 : u32,  count_4 : u32,  widths_3 : u32) -> u32
{
    var n_7 : u32 = (extractBits((shared_stream_0[s_13]), u32((i32(0))), u32((i32(3)))));
    var _S87 : u32;
    if(count_4 > u32(0))
    {
        var _S88 : u32 = (extractBits((shared_stream_0[s_13]), u32((i32(3))), u32((i32(6)))));
        _S87 = p_10 + n_7 * _S88;
    }
    else
    {
        _S87 = p_10;
    }
    if(count_4 > u32(1))
    {
        _S87 = _S87 + (u32(3) * n_7 + (count_4 - u32(1)) * width_sum_0(widths_3));
    }
    return _S87;
}

fn width_field_0( position_0 : u32) -> u32
{
    var w_0 : u32 = load_bits_0(position_0, u32(5));
    var _S89 : u32;
    if(w_0 == u32(31))
    {
        _S89 = u32(32);
    }
    else
    {
        _S89 = w_0;
    }
    return _S89;
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
    var _S90 : u32;
    if(code_0 == u32(255))
    {
        _S90 = fixed_width_0(elements_1, widths_5);
    }
    else
    {
        _S90 = code_0 * elements_1;
    }
    return _S90;
}

fn length_of_0( r_5 : u32) -> u32
{
    return shared_lengths_0[member_0 * u32(64) + ((r_5 & (u32(63))))];
}

fn id_at_0( rank_0 : u32) -> u32
{
    return nth_bit_0(the_boundary_0, rank_0);
}

fn waiting_vertices_0( h_14 : Header_0) -> vec2<u32>
{
    var _S91 : vec2<u32> = mask_none_0();
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
            var _S92 : vec2<u32> = (waiting_1 & ((~mask_bit_0(((ids_before_0(r_6)) & (u32(63)))))));
            var _S93 : u32 = r_6 + u32(1);
            waiting_1 = _S92;
            r_6 = _S93;
        }
    }
    else
    {
        waiting_1 = _S91;
    }
    r_6 = u32(0);
    var rank_1 : u32 = u32(0);
    for(;;)
    {
        var _S94 : bool;
        if(r_6 < (h_14.references_1))
        {
            _S94 = mask_any_0(h_14.private_refs_1);
        }
        else
        {
            _S94 = false;
        }
        if(_S94)
        {
        }
        else
        {
            break;
        }
        var i_8 : u32 = u32(1);
        for(;;)
        {
            var _S95 : bool;
            if(i_8 < (length_of_0(r_6)))
            {
                _S95 = mask_test_0(h_14.private_refs_1, r_6);
            }
            else
            {
                _S95 = false;
            }
            if(_S95)
            {
            }
            else
            {
                break;
            }
            var _S96 : vec2<u32> = (waiting_1 | ((mask_bit_0(id_at_0(rank_1 + i_8)))));
            var _S97 : u32 = i_8 + u32(1);
            waiting_1 = _S96;
            i_8 = _S97;
        }
        var rank_2 : u32 = rank_1 + length_of_0(r_6);
        r_6 = r_6 + u32(1);
        rank_1 = rank_2;
    }
    return waiting_1;
}

fn after_ones_0( p_11 : u32,  n_8 : u32) -> u32
{
    if(n_8 == u32(0))
    {
        return p_11;
    }
    var w_1 : u32 = (p_11 >> (u32(5)));
    var word_1 : u32 = ((load_word_0(w_1)) & ((~word_below_0((p_11 & (u32(31)))))));
    var ones_1 : u32 = countOneBits(word_1);
    var empty_0 : u32 = u32(0);
    var _S98 : u32 = n_8;
    var w_2 : u32 = w_1;
    var word_2 : u32 = word_1;
    for(;;)
    {
        if(ones_1 < _S98)
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
        var _S99 : bool;
        if(w_2 >= (push_0.blob_words_0))
        {
            _S99 = true;
        }
        else
        {
            _S99 = empty_0 > u32(512);
        }
        if(_S99)
        {
            error_0 = u32(8);
            return p_11;
        }
        var _S100 : u32 = _S98 - ones_1;
        var w_3 : u32 = w_2 + u32(1);
        var word_3 : u32 = load_word_0(w_3);
        ones_1 = countOneBits(word_3);
        _S98 = _S100;
        w_2 = w_3;
        word_2 = word_3;
    }
    ones_1 = _S98;
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
    var _S101 : bool = mask_any_0(h_15.owned_refs_0);
    var _S102 : u32 = chain_vertices_0(h_15, u32(64)).x;
    var p_12 : u32 = anchors_begin_0(h_15);
    var codes_2 : u32 = h_15.codes_1;
    var _S103 : u32 = mask_count_0(the_starts_0);
    all_places_0[job_meshlet_0].anchors_0 = p_12;
    var count_5 : u32 = _S103;
    var p_13 : u32 = p_12;
    var s_14 : u32 = u32(0);
    var low_2 : u32 = u32(0);
    var ones_2 : u32 = u32(0);
    for(;;)
    {
        if(s_14 < stream_total_0)
        {
        }
        else
        {
            break;
        }
        var count_6 : u32 = anchors_of_0(h_15, s_14, count_5);
        var _S104 : u32 = further_widths_0(p_13, s_14, count_6);
        var _S105 : u32 = after_anchors_0(p_13, s_14, count_6, _S104);
        if(!_S101)
        {
            var _S106 : u32 = s_14 + u32(1);
            count_5 = count_6;
            p_13 = _S105;
            s_14 = _S106;
            continue;
        }
        var n_9 : u32 = (extractBits((shared_stream_0[s_14]), u32((i32(0))), u32((i32(3)))));
        var code_1 : u32 = code_at_1(&(codes_2), s_14, true);
        var low_3 : u32 = low_2 + _S102 * low_width_0(code_1, n_9, codes_2 - u32(5) * n_9);
        var ones_3 : u32;
        if(code_1 != u32(255))
        {
            ones_3 = ones_2 + _S102 * n_9;
        }
        else
        {
            ones_3 = ones_2;
        }
        var _S107 : u32 = code_at_1(&(codes_2), s_14, false);
        low_2 = low_3;
        ones_2 = ones_3;
        var _S106 : u32 = s_14 + u32(1);
        count_5 = count_6;
        p_13 = _S105;
        s_14 = _S106;
    }
    all_places_0[job_meshlet_0].chains_0 = p_13;
    if(error_0 == u32(0))
    {
        count_5 = p_13 + low_2;
    }
    else
    {
        count_5 = u32(4294967295);
    }
    all_places_0[job_meshlet_0].quotients_0 = count_5;
    var _S108 : vec2<u32>;
    if(live_0)
    {
        _S108 = waiting_vertices_0(h_15);
    }
    else
    {
        _S108 = mask_none_0();
    }
    all_places_0[job_meshlet_0].waiting_0 = _S108;
    var interior_1 : u32 = after_ones_0(p_13 + low_2, ones_2);
    if(error_0 == u32(0))
    {
        count_5 = interior_1;
    }
    else
    {
        count_5 = u32(4294967295);
    }
    all_places_0[job_meshlet_0].interior_0 = count_5;
    return;
}

fn mask_msb_0( m_8 : vec2<u32>) -> u32
{
    var _S109 : u32 = m_8.y;
    var _S110 : u32;
    if(_S109 != u32(0))
    {
        _S110 = u32(32) + firstbithigh_0(_S109);
    }
    else
    {
        var _S111 : u32 = m_8.x;
        if(_S111 != u32(0))
        {
            _S110 = firstbithigh_0(_S111);
        }
        else
        {
            _S110 = u32(64);
        }
    }
    return _S110;
}

fn loop_begin_0( h_16 : Header_0,  r_7 : u32) -> u32
{
    var before_3 : vec2<u32> = ((h_16.loop_ends_2) & ((mask_below_0(r_7))));
    var _S112 : u32;
    if(mask_any_0(before_3))
    {
        _S112 = mask_msb_0(before_3) + u32(1);
    }
    else
    {
        _S112 = u32(0);
    }
    return _S112;
}

fn check_length_0( h_17 : Header_0,  r_8 : u32,  rank_3 : u32)
{
    var loop_1 : vec2<u32> = loop_of_0(h_17, r_8);
    var end_1 : u32 = rank_3 + length_of_0(r_8);
    if(end_1 == rank_3)
    {
        error_0 = u32(4);
    }
    var _S113 : bool;
    if(r_8 == (loop_begin_0(h_17, r_8)))
    {
        _S113 = rank_3 != (loop_1.x);
    }
    else
    {
        _S113 = false;
    }
    if(_S113)
    {
        error_0 = u32(4);
    }
    if(mask_test_0(h_17.loop_ends_2, r_8))
    {
        _S113 = end_1 != (loop_1.y);
    }
    else
    {
        _S113 = end_1 > (loop_1.y);
    }
    if(_S113)
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
        var _S114 : vec2<u32> = (begins_0 | ((mask_bit_0((rank_4 & (u32(63)))))));
        var rank_5 : u32 = rank_4 + length_of_0(r_9);
        var _S115 : u32 = r_9 + u32(1);
        begins_0 = _S114;
        r_9 = _S115;
        rank_4 = rank_5;
    }
    connectivity_0[job_place_0].references_0 = begins_0;
    return;
}

fn close_pass_0()
{
    if(error_0 != u32(0))
    {
        var _S116 : u32 = atomicOr(&(the_summaries_0[job_place_0]), (error_0 << (u32(16))));
    }
    return;
}

fn lengths_shader_0()
{
    var live_1 : bool = open_pass_0(u32(8));
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
    var r_10 : u32 = first_item_0;
    for(;;)
    {
        if(r_10 < references_3)
        {
        }
        else
        {
            break;
        }
        var _S117 : u32 = measured_length_0(h_19, r_10);
        shared_lengths_0[member_0 * u32(64) + r_10] = min(_S117, u32(64));
        r_10 = r_10 + u32(8);
    }
    workgroupBarrier();
    var _S118 : bool;
    if(present_0)
    {
        _S118 = first_item_0 == u32(7);
    }
    else
    {
        _S118 = false;
    }
    if(_S118)
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
        _S118 = (mask_count_0(h_19.loop_ends_2)) != (mask_count_0(the_starts_0));
    }
    else
    {
        _S118 = false;
    }
    if(_S118)
    {
        error_0 = u32(4);
    }
    r_10 = first_item_0;
    for(;;)
    {
        if(r_10 < references_3)
        {
            _S118 = error_0 == u32(0);
        }
        else
        {
            _S118 = false;
        }
        if(_S118)
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
    if(first_item_0 == u32(0))
    {
        place_references_0(h_19, references_3);
    }
    close_pass_0();
    return;
}

@compute
@workgroup_size(64, 1, 1)
fn lengths_main(@builtin(local_invocation_index) thread_0 : u32, @builtin(workgroup_id) workgroup_0 : vec3<u32>, @builtin(global_invocation_id) invocation_0 : vec3<u32>)
{
    the_thread_0 = thread_0;
    the_workgroup_0 = workgroup_0;
    the_invocation_0 = invocation_0;
    lengths_shader_0();
    return;
}

var<workgroup> shared_hops_0 : u32;

fn previous_reference_0( h_20 : Header_0,  r_11 : u32) -> u32
{
    var _S119 : u32;
    if(r_11 == (loop_begin_0(h_20, r_11)))
    {
        _S119 = mask_lsb_0(((h_20.loop_ends_2) & ((~mask_below_0(r_11)))));
    }
    else
    {
        _S119 = r_11 - u32(1);
    }
    return _S119;
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

fn places_of_0( m_9 : u32) -> Places_0
{
    var _S120 : Places_0 = Places_0( all_places_0[m_9].foreign_refs_0, all_places_0[m_9].private_refs_0, all_places_0[m_9].loop_ends_0, all_places_0[m_9].counts_0, all_places_0[m_9].lengths_0, all_places_0[m_9].entries_0, all_places_0[m_9].codes_0, all_places_0[m_9].anchors_0, all_places_0[m_9].chains_0, all_places_0[m_9].quotients_0, all_places_0[m_9].interior_0, all_places_0[m_9].waiting_0 );
    if((all_places_0[m_9].quotients_0) == u32(4294967295))
    {
        error_0 = u32(7);
    }
    return _S120;
}

fn unzigzag_0( u_0 : u32) -> u32
{
    return (((u_0 >> (u32(1)))) ^ ((u32(0) - ((u_0 & (u32(1)))))));
}

fn bits_mask_0( s_15 : u32) -> u32
{
    var _S121 : u32 = (extractBits((shared_stream_0[s_15]), u32((i32(3))), u32((i32(6)))));
    return word_below_0(_S121);
}

fn anchor_value_0( s_16 : u32,  p_14 : u32,  index_0 : u32,  widths_6 : u32,  c_2 : u32) -> u32
{
    var n_10 : u32 = (extractBits((shared_stream_0[s_16]), u32((i32(0))), u32((i32(3)))));
    var bits_2 : u32 = (extractBits((shared_stream_0[s_16]), u32((i32(3))), u32((i32(6)))));
    var value_3 : u32 = load_bits_0(p_14 + c_2 * bits_2, bits_2);
    var value_4 : u32;
    if(index_0 > u32(0))
    {
        var _S122 : u32 = u32(6) * c_2;
        var at_3 : u32 = p_14 + n_10 * (bits_2 + u32(3)) + (index_0 - u32(1)) * width_sum_0(widths_6) + width_sum_0((widths_6 & ((((u32(1) << (_S122))) - u32(1)))));
        var _S123 : u32 = (extractBits((widths_6), u32((i32(_S122))), u32((i32(6)))));
        value_4 = value_3 + unzigzag_0(load_bits_0(at_3, _S123));
    }
    else
    {
        value_4 = value_3;
    }
    var _S124 : u32 = bits_mask_0(s_16);
    return (value_4 & (_S124));
}

fn is_packed_0( s_17 : u32) -> bool
{
    var _S125 : u32 = (extractBits((shared_places_0[s_17]), u32((i32(28))), u32((i32(2)))));
    return _S125 <= u32(2);
}

fn put_field_0( at_4 : u32,  value_5 : u32) -> vec2<u32>
{
    var _S126 : vec2<u32>;
    if(at_4 < u32(32))
    {
        _S126 = vec2<u32>((value_5 << (at_4)), (((value_5 >> (u32(1)))) >> ((u32(31) - at_4))));
    }
    else
    {
        _S126 = vec2<u32>(u32(0), (value_5 << ((at_4 - u32(32)))));
    }
    return _S126;
}

fn word_of_0( s_18 : u32,  id_0 : u32) -> u32
{
    var _S127 : u32 = (extractBits((shared_places_0[s_18]), u32((i32(0))), u32((i32(16)))));
    var _S128 : u32 = (extractBits((shared_places_0[s_18]), u32((i32(16))), u32((i32(6)))));
    return _S127 + _S128 * ((id_0 & (u32(63))));
}

fn vertex_at_0( s_19 : u32,  id_1 : u32) -> vec2<u32>
{
    var word_5 : u32 = word_of_0(s_19, id_1);
    var _S129 : u32 = (extractBits((shared_places_0[s_19]), u32((i32(28))), u32((i32(2)))));
    if(_S129 == u32(1))
    {
        return vec2<u32>(all_values_0[the_values_0 + word_5], u32(0));
    }
    var _S130 : u32 = u32(2) * ((word_5 >> (u32(1))));
    return vec2<u32>(all_values_0[the_values_0 + _S130], all_values_0[the_values_0 + _S130 + u32(1)]);
}

fn put_vertex_0( s_20 : u32,  id_2 : u32,  fields_1 : vec2<u32>)
{
    var word_6 : u32 = word_of_0(s_20, id_2);
    var _S131 : u32 = (extractBits((shared_places_0[s_20]), u32((i32(28))), u32((i32(2)))));
    if(_S131 == u32(1))
    {
        all_values_0[the_values_0 + word_6] = fields_1.x;
    }
    else
    {
        var _S132 : u32 = u32(2) * ((word_6 >> (u32(1))));
        all_values_0[the_values_0 + _S132] = fields_1.x;
        all_values_0[the_values_0 + _S132 + u32(1)] = fields_1.y;
    }
    return;
}

fn put_value_0( s_21 : u32,  c_3 : u32,  id_3 : u32,  value_6 : u32)
{
    var _S133 : u32 = bits_mask_0(s_21);
    var inside_0 : u32 = (value_6 & (_S133));
    var _S134 : bool = is_packed_0(s_21);
    if(!_S134)
    {
        var _S135 : u32 = the_values_0;
        var _S136 : u32 = word_of_0(s_21, id_3);
        all_values_0[_S135 + (_S136 + c_3)] = inside_0;
        return;
    }
    var before_5 : vec2<u32>;
    if(c_3 == u32(0))
    {
        before_5 = vec2<u32>(u32(0));
    }
    else
    {
        var _S137 : vec2<u32> = vertex_at_0(s_21, id_3);
        before_5 = _S137;
    }
    var _S138 : u32 = (extractBits((shared_places_0[s_21]), u32((i32(22))), u32((i32(6)))));
    put_vertex_0(s_21, id_3, (before_5 | ((put_field_0(c_3 * _S138, inside_0)))));
    return;
}

fn read_anchor_0( h_21 : Header_0,  index_1 : u32,  wanted_0 : u32,  id_4 : u32)
{
    var _S139 : Places_0 = places_of_0(h_21.meshlet_0);
    var _S140 : u32 = mask_count_0(the_starts_0);
    var p_15 : u32 = _S139.anchors_0;
    var count_7 : u32 = _S140;
    var widths_7 : u32 = u32(0);
    var s_22 : u32 = u32(0);
    for(;;)
    {
        if(s_22 <= wanted_0)
        {
        }
        else
        {
            break;
        }
        if(s_22 == u32(0))
        {
        }
        else
        {
            var _S141 : u32 = after_anchors_0(p_15, s_22 - u32(1), count_7, widths_7);
            p_15 = _S141;
        }
        var count_8 : u32 = anchors_of_0(h_21, s_22, count_7);
        var _S142 : u32 = further_widths_0(p_15, s_22, count_8);
        var _S143 : u32 = s_22 + u32(1);
        count_7 = count_8;
        widths_7 = _S142;
        s_22 = _S143;
    }
    var _S144 : vec2<u32> = vec2<u32>(u32(0));
    var c_4 : u32 = u32(0);
    var fields_2 : vec2<u32> = _S144;
    for(;;)
    {
        var _S145 : u32 = (extractBits((shared_stream_0[wanted_0]), u32((i32(0))), u32((i32(3)))));
        if(c_4 < _S145)
        {
        }
        else
        {
            break;
        }
        var value_7 : u32 = anchor_value_0(wanted_0, p_15, index_1, widths_7, c_4);
        var _S146 : bool = is_packed_0(wanted_0);
        if(_S146)
        {
            var _S147 : u32 = (extractBits((shared_places_0[wanted_0]), u32((i32(22))), u32((i32(6)))));
            fields_2 = (fields_2 | ((put_field_0(c_4 * _S147, value_7))));
        }
        else
        {
            put_value_0(wanted_0, c_4, id_4, value_7);
        }
        c_4 = c_4 + u32(1);
    }
    var _S148 : bool = is_packed_0(wanted_0);
    if(_S148)
    {
        put_vertex_0(wanted_0, id_4, fields_2);
    }
    return;
}

fn owner_of_0( h_22 : Header_0,  r_12 : u32) -> u32
{
    var _S149 : u32 = entry_owner_0(h_22, entry_position_0(h_22, r_12));
    return _S149;
}

fn next_reference_0( h_23 : Header_0,  r_13 : u32) -> u32
{
    var _S150 : u32;
    if(mask_test_0(h_23.loop_ends_2, r_13))
    {
        _S150 = loop_begin_0(h_23, r_13);
    }
    else
    {
        _S150 = r_13 + u32(1);
    }
    return _S150;
}

fn read_corner_0( own_1 : Header_0,  j_0 : u32,  s_23 : u32,  id_5 : u32)
{
    var h_24 : Header_0 = own_1;
    var _S151 : u32 = j_0;
    var hop_0 : u32 = u32(0);
    for(;;)
    {
        var _S152 : bool;
        if(hop_0 <= shared_hops_0)
        {
            _S152 = error_0 == u32(0);
        }
        else
        {
            _S152 = false;
        }
        if(_S152)
        {
        }
        else
        {
            break;
        }
        var seams_3 : vec2<u32> = seam_references_0(h_24, s_23);
        var shared_refs_0 : vec2<u32> = ((h_24.foreign_refs_1) & ((~seams_3)));
        var _S153 : bool = (h_24.references_1) > u32(0);
        var before_6 : u32;
        if(_S153)
        {
            before_6 = ((previous_reference_0(h_24, _S151)) & (u32(63)));
        }
        else
        {
            before_6 = u32(0);
        }
        var follow_0 : bool = mask_test_0(shared_refs_0, _S151);
        var follow_before_0 : bool = mask_test_0(shared_refs_0, before_6);
        var _S154 : bool;
        if(!follow_0)
        {
            _S154 = !follow_before_0;
        }
        else
        {
            _S154 = false;
        }
        if(_S154)
        {
            if(_S153)
            {
                _S151 = mask_count_0(((stored_corners_0(h_24, seams_3)) & ((mask_below_0(_S151)))));
            }
            read_anchor_0(h_24, _S151, s_23, id_5);
            return;
        }
        var _S155 : bool;
        if(follow_0)
        {
            _S155 = follow_before_0;
        }
        else
        {
            _S155 = false;
        }
        var follow_1 : bool;
        if(_S155)
        {
            var _S156 : u32 = owner_of_0(h_24, before_6);
            var _S157 : u32 = owner_of_0(h_24, _S151);
            follow_1 = _S156 >= _S157;
        }
        else
        {
            follow_1 = follow_0;
        }
        var _S158 : u32;
        if(follow_1)
        {
            _S158 = _S151;
        }
        else
        {
            _S158 = before_6;
        }
        var entry_3 : u32 = entry_position_0(h_24, _S158);
        var slot_1 : u32 = entry_slot_0(h_24, entry_3);
        var _S159 : u32 = entry_owner_0(h_24, entry_3);
        var h_25 : Header_0 = header_of_0(_S159);
        var _S160 : u32 = slot_reference_0(h_25, slot_1);
        var reference_1 : u32 = (_S160 & (u32(63)));
        if(follow_1)
        {
            _S151 = ((next_reference_0(h_25, reference_1)) & (u32(63)));
        }
        else
        {
            _S151 = reference_1;
        }
        var _S161 : u32 = hop_0 + u32(1);
        h_24 = h_25;
        hop_0 = _S161;
    }
    if(error_0 == u32(0))
    {
        error_0 = u32(6);
    }
    return;
}

fn corners_shader_0()
{
    if(the_thread_0 == u32(0))
    {
        shared_hops_0 = u32(8);
    }
    var _S162 : bool = open_pass_0(u32(8));
    var _S163 : bool;
    if(!_S162)
    {
        _S163 = true;
    }
    else
    {
        _S163 = (the_workgroup_0.y) >= stream_end_0;
    }
    if(_S163)
    {
        return;
    }
    var h_26 : Header_0 = open_header_0();
    var _S164 : bool = (h_26.references_1) == u32(0);
    var _S165 : u32;
    if(_S164)
    {
        _S165 = mask_count_0(the_starts_0);
    }
    else
    {
        _S165 = h_26.references_1;
    }
    var j_1 : u32 = first_item_0;
    for(;;)
    {
        if(j_1 < _S165)
        {
            _S163 = error_0 == u32(0);
        }
        else
        {
            _S163 = false;
        }
        if(_S163)
        {
        }
        else
        {
            break;
        }
        var id_6 : u32;
        if(_S164)
        {
            id_6 = ((ids_before_0(j_1)) & (u32(63)));
        }
        else
        {
            id_6 = id_at_0(nth_bit_0(the_references_0, j_1));
        }
        read_corner_0(h_26, j_1, the_workgroup_0.y, id_6);
        j_1 = j_1 + u32(8);
    }
    close_pass_0();
    return;
}

@compute
@workgroup_size(64, 1, 1)
fn corners_main(@builtin(local_invocation_index) thread_1 : u32, @builtin(workgroup_id) workgroup_1 : vec3<u32>, @builtin(global_invocation_id) invocation_1 : vec3<u32>)
{
    the_thread_0 = thread_1;
    the_workgroup_0 = workgroup_1;
    the_invocation_0 = invocation_1;
    corners_shader_0();
    return;
}

struct Run_0
{
     rank_8 : u32,
     steps_0 : u32,
};

fn Run_x24init_0( rank_9 : u32,  steps_1 : u32) -> Run_0
{
    var _S166 : Run_0;
    _S166.rank_8 = rank_9;
    _S166.steps_0 = steps_1;
    return _S166;
}

fn run_of_0( r_14 : u32) -> Run_0
{
    var rank_10 : u32 = nth_bit_0(the_references_0, r_14);
    var later_0 : vec2<u32> = (the_references_0 & ((~mask_below_0(rank_10 + u32(1)))));
    var end_2 : u32;
    if(mask_any_0(later_0))
    {
        end_2 = mask_lsb_0(later_0);
    }
    else
    {
        end_2 = mask_count_0(the_boundary_0);
    }
    return Run_x24init_0(rank_10, min(end_2 - rank_10, u32(64)));
}

fn first_stream_0() -> u32
{
    var s_24 : u32 = the_workgroup_0.y;
    var later_1 : bool;
    if(s_24 > u32(0))
    {
        var _S167 : u32 = (extractBits((shared_stream_0[s_24]), u32((i32(9))), u32((i32(3)))));
        later_1 = _S167 == u32(5);
    }
    else
    {
        later_1 = false;
    }
    var _S168 : u32;
    if(later_1)
    {
        _S168 = stream_end_0;
    }
    else
    {
        _S168 = s_24;
    }
    return _S168;
}

struct Source_0
{
     total_0 : u32,
     first_2 : u32,
     codes_3 : u32,
     low_4 : u32,
     quotients_1 : u32,
};

fn Source_x24init_0( total_1 : u32,  first_3 : u32,  codes_4 : u32,  low_5 : u32,  quotients_2 : u32) -> Source_0
{
    var _S169 : Source_0;
    _S169.total_0 = total_1;
    _S169.first_2 = first_3;
    _S169.codes_3 = codes_4;
    _S169.low_4 = low_5;
    _S169.quotients_1 = quotients_2;
    return _S169;
}

fn source_of_0( h_27 : Header_0,  r_15 : u32) -> Source_0
{
    var foreign_0 : bool = mask_test_0(h_27.foreign_refs_1, r_15);
    var entry_4 : u32 = entry_position_0(h_27, r_15);
    var reference_2 : u32;
    if(foreign_0)
    {
        var _S170 : u32 = entry_owner_0(h_27, entry_4);
        reference_2 = _S170;
    }
    else
    {
        reference_2 = h_27.meshlet_0;
    }
    var owner_1 : Header_0 = header_of_0(reference_2);
    if(foreign_0)
    {
        var _S171 : u32 = slot_reference_0(owner_1, entry_slot_0(h_27, entry_4));
        reference_2 = (_S171 & (u32(63)));
    }
    else
    {
        reference_2 = r_15;
    }
    var vertices_0 : vec2<u32> = chain_vertices_0(owner_1, reference_2);
    var places_1 : Places_0 = places_of_0(owner_1.meshlet_0);
    return Source_x24init_0(vertices_0.x, vertices_0.y, places_1.codes_0, places_1.chains_0, places_1.quotients_0);
}

var<private> residual_code_0 : u32;

fn fixed_widths_0( position_1 : u32,  n_11 : u32) -> vec2<u32>
{
    var _S172 : vec2<u32> = vec2<u32>(u32(0));
    var c_5 : u32 = u32(0);
    var widths_8 : vec2<u32> = _S172;
    for(;;)
    {
        if(c_5 < n_11)
        {
        }
        else
        {
            break;
        }
        var widths_9 : vec2<u32> = (widths_8 | ((put_field_0(u32(6) * c_5, width_field_0(position_1 + u32(5) * c_5)))));
        c_5 = c_5 + u32(1);
        widths_8 = widths_9;
    }
    return widths_8;
}

var<private> residual_widths_0 : vec2<u32>;

struct UnaryReader_0
{
     window_1 : u32,
     base_4 : u32,
     cursor_0 : u32,
};

fn UnaryReader_x24init_0( window_2 : u32,  base_5 : u32,  cursor_1 : u32) -> UnaryReader_0
{
    var _S173 : UnaryReader_0;
    _S173.window_1 = window_2;
    _S173.base_4 = base_5;
    _S173.cursor_0 = cursor_1;
    return _S173;
}

fn seek_unary_0( p_16 : u32) -> UnaryReader_0
{
    return UnaryReader_x24init_0(((load_word_0((p_16 >> (u32(5))))) & ((~word_below_0((p_16 & (u32(31))))))), (p_16 & (u32(4294967264))), p_16);
}

var<private> unary_0 : UnaryReader_0;

var<private> low_position_0 : u32;

var<private> low_index_0 : u32;

var<private> low_words_0 : vec2<u32>;

fn seek_low_0( p_17 : u32)
{
    low_position_0 = p_17;
    var _S174 : u32 = (p_17 >> (u32(5)));
    low_index_0 = _S174;
    low_words_0 = load_words2_0(_S174);
    return;
}

fn last_id_0( h_28 : Header_0,  r_16 : u32,  run_0 : Run_0) -> u32
{
    var _S175 : u32;
    if(mask_test_0(h_28.loop_ends_2, r_16))
    {
        _S175 = loop_of_0(h_28, r_16).x;
    }
    else
    {
        _S175 = run_0.rank_8 + run_0.steps_0;
    }
    return id_at_0(_S175);
}

fn inner_ids_0( run_1 : Run_0) -> vec2<u32>
{
    return (((the_boundary_0 & ((~mask_below_0(id_at_0(run_1.rank_8) + u32(1)))))) & ((mask_below_0(id_at_0(run_1.rank_8 + run_1.steps_0 - u32(1)) + u32(1)))));
}

struct Chain_0
{
     steps_2 : u32,
     from_0 : u32,
     to_0 : u32,
     inner_1 : vec2<u32>,
     backwards_0 : bool,
};

fn Chain_x24init_0( steps_3 : u32,  from_1 : u32,  to_1 : u32,  inner_2 : vec2<u32>,  backwards_1 : bool) -> Chain_0
{
    var _S176 : Chain_0;
    _S176.steps_2 = steps_3;
    _S176.from_0 = from_1;
    _S176.to_0 = to_1;
    _S176.inner_1 = inner_2;
    _S176.backwards_0 = backwards_1;
    return _S176;
}

fn chain_of_0( h_29 : Header_0,  r_17 : u32,  run_2 : Run_0) -> Chain_0
{
    var foreign_1 : bool = mask_test_0(h_29.foreign_refs_1, r_17);
    var begin_1 : u32 = id_at_0(run_2.rank_8);
    var end_3 : u32 = last_id_0(h_29, r_17, run_2);
    var inner_3 : vec2<u32> = inner_ids_0(run_2);
    var _S177 : u32;
    if(foreign_1)
    {
        _S177 = end_3;
    }
    else
    {
        _S177 = begin_1;
    }
    var _S178 : u32;
    if(foreign_1)
    {
        _S178 = begin_1;
    }
    else
    {
        _S178 = end_3;
    }
    return Chain_x24init_0(run_2.steps_0, _S177, _S178, inner_3, foreign_1);
}

fn pack4_0( x_0 : u32,  y_0 : u32,  z_0 : u32,  w_4 : u32) -> u32
{
    return (((((x_0 | (((y_0 << (u32(8))))))) | (((z_0 << (u32(16))))))) | (((w_4 << (u32(24))))));
}

struct Triple_0
{
     x_1 : u32,
     y_1 : u32,
     z_1 : u32,
};

fn Triple_x24init_0( x_2 : u32,  y_2 : u32,  z_2 : u32) -> Triple_0
{
    var _S179 : Triple_0;
    _S179.x_1 = x_2;
    _S179.y_1 = y_2;
    _S179.z_1 = z_2;
    return _S179;
}

fn grid_position_0( id_7 : u32) -> Triple_0
{
    var word_7 : u32 = word_of_0(u32(0), id_7);
    var _S180 : bool = is_packed_0(u32(0));
    if(!_S180)
    {
        return Triple_x24init_0(all_values_0[the_values_0 + word_7], all_values_0[the_values_0 + (word_7 + u32(1))], all_values_0[the_values_0 + (word_7 + u32(2))]);
    }
    var _S181 : u32 = u32(2) * ((word_7 >> (u32(1))));
    return Triple_x24init_0((all_values_0[the_values_0 + _S181] & (u32(2097151))), (((((all_values_0[the_values_0 + _S181] >> (u32(21)))) | (((all_values_0[the_values_0 + _S181 + u32(1)] << (u32(11))))))) & (u32(2097151))), (((all_values_0[the_values_0 + _S181 + u32(1)] >> (u32(10)))) & (u32(2097151))));
}

fn difference_0( to_2 : Triple_0,  from_2 : Triple_0) -> Triple_0
{
    var _S182 : Triple_0 = to_2;
    _S182.x_1 = _S182.x_1 - from_2.x_1;
    _S182.y_1 = _S182.y_1 - from_2.y_1;
    _S182.z_1 = _S182.z_1 - from_2.z_1;
    return _S182;
}

fn magnitude_0( x_3 : u32) -> u32
{
    var _S183 : u32;
    if(i32(x_3) < i32(0))
    {
        _S183 = u32(0) - x_3;
    }
    else
    {
        _S183 = x_3;
    }
    return _S183;
}

fn magnitudes_0( v_0 : Triple_0) -> u32
{
    return ((((magnitude_0(v_0.x_1)) | ((magnitude_0(v_0.y_1))))) | ((magnitude_0(v_0.z_1))));
}

fn bit_length_0( x_4 : u32) -> u32
{
    return firstbithigh_0(x_4) + u32(1);
}

fn excess_0( x_5 : u32,  y_3 : u32) -> u32
{
    var _S184 : u32;
    if(x_5 > y_3)
    {
        _S184 = x_5 - y_3;
    }
    else
    {
        _S184 = u32(0);
    }
    return _S184;
}

fn shift_right_0( x_6 : u32,  n_12 : u32) -> u32
{
    return u32((i32(x_6) >> (n_12)));
}

fn shifted_0( v_1 : Triple_0,  n_13 : u32) -> Triple_0
{
    var _S185 : Triple_0 = v_1;
    _S185.x_1 = shift_right_0(_S185.x_1, n_13);
    _S185.y_1 = shift_right_0(_S185.y_1, n_13);
    _S185.z_1 = shift_right_0(_S185.z_1, n_13);
    return _S185;
}

fn dot3_0( v_2 : Triple_0,  w_5 : Triple_0) -> u32
{
    return v_2.x_1 * w_5.x_1 + v_2.y_1 * w_5.y_1 + v_2.z_1 * w_5.z_1;
}

fn signed_quotient_0( x_7 : u32,  d_0 : u32) -> u32
{
    var quotient_0 : u32 = magnitude_0(x_7) / d_0;
    var _S186 : u32;
    if(i32(x_7) < i32(0))
    {
        _S186 = u32(0) - quotient_0;
    }
    else
    {
        _S186 = quotient_0;
    }
    return _S186;
}

struct Weights_0
{
     exist_0 : bool,
     s_25 : u32,
     u_1 : u32,
};

fn affine_weights_0( a_0 : u32,  b_0 : u32,  o_0 : u32,  v_3 : u32) -> Weights_0
{
    var origin_0 : Triple_0 = grid_position_0(a_0);
    var _S187 : Triple_0 = grid_position_0(b_0);
    var e_0 : Triple_0 = difference_0(_S187, origin_0);
    var _S188 : Triple_0 = grid_position_0(o_0);
    var f_0 : Triple_0 = difference_0(_S188, origin_0);
    var _S189 : Triple_0 = grid_position_0(v_3);
    var r_18 : Triple_0 = difference_0(_S189, origin_0);
    var h_30 : u32 = excess_0(bit_length_0(((((magnitudes_0(e_0)) | ((magnitudes_0(f_0))))) | ((magnitudes_0(r_18))))), u32(14));
    var e_1 : Triple_0 = shifted_0(e_0, h_30);
    var f_1 : Triple_0 = shifted_0(f_0, h_30);
    var r_19 : Triple_0 = shifted_0(r_18, h_30);
    var ee_0 : u32 = dot3_0(e_1, e_1);
    var ff_0 : u32 = dot3_0(f_1, f_1);
    var re_0 : u32 = dot3_0(r_19, e_1);
    var rf_0 : u32 = dot3_0(r_19, f_1);
    var n_14 : u32 = bit_length_0((((((ee_0 | (ff_0))) | ((magnitude_0(re_0))))) | ((magnitude_0(rf_0)))));
    var up_0 : u32 = excess_0(u32(15), n_14);
    var down_0 : u32 = excess_0(n_14, u32(15));
    var ee_1 : u32 = shift_right_0((ee_0 << (up_0)), down_0);
    var ef_0 : u32 = shift_right_0(((dot3_0(e_1, f_1)) << (up_0)), down_0);
    var ff_1 : u32 = shift_right_0((ff_0 << (up_0)), down_0);
    var re_1 : u32 = shift_right_0((re_0 << (up_0)), down_0);
    var rf_1 : u32 = shift_right_0((rf_0 << (up_0)), down_0);
    var product_0 : u32 = ee_1 * ff_1;
    var determinant_0 : u32 = product_0 - ef_0 * ef_0;
    var d_1 : u32 = (determinant_0 >> (u32(8)));
    var w_6 : Weights_0;
    var _S190 : bool;
    if(i32(determinant_0) > ((i32(product_0) >> (u32(5)))))
    {
        _S190 = d_1 != u32(0);
    }
    else
    {
        _S190 = false;
    }
    w_6.exist_0 = _S190;
    w_6.s_25 = u32(0);
    w_6.u_1 = u32(0);
    if(!_S190)
    {
        return w_6;
    }
    var _S191 : u32 = signed_quotient_0(re_1 * ff_1 - rf_1 * ef_0, d_1);
    w_6.s_25 = _S191;
    var _S192 : u32 = signed_quotient_0(rf_1 * ee_1 - re_1 * ef_0, d_1);
    w_6.u_1 = _S192;
    if((magnitude_0(_S191)) < u32(1024))
    {
        _S190 = (magnitude_0(w_6.u_1)) < u32(1024);
    }
    else
    {
        _S190 = false;
    }
    w_6.exist_0 = _S190;
    return w_6;
}

fn line_weights_0( a_1 : u32,  b_1 : u32,  v_4 : u32) -> Weights_0
{
    var origin_1 : Triple_0 = grid_position_0(a_1);
    var _S193 : Triple_0 = grid_position_0(b_1);
    var e_2 : Triple_0 = difference_0(_S193, origin_1);
    var _S194 : Triple_0 = grid_position_0(v_4);
    var r_20 : Triple_0 = difference_0(_S194, origin_1);
    var h_31 : u32 = excess_0(bit_length_0(((magnitudes_0(e_2)) | ((magnitudes_0(r_20))))), u32(10));
    var e_3 : Triple_0 = shifted_0(e_2, h_31);
    var ee_2 : u32 = dot3_0(e_3, e_3);
    var re_2 : u32 = dot3_0(shifted_0(r_20, h_31), e_3);
    var w_7 : Weights_0;
    var _S195 : i32 = i32(ee_2);
    var _S196 : bool;
    if(_S195 > i32(0))
    {
        _S196 = i32(re_2) >= i32(0);
    }
    else
    {
        _S196 = false;
    }
    if(_S196)
    {
        _S196 = i32(re_2) <= _S195;
    }
    else
    {
        _S196 = false;
    }
    w_7.exist_0 = _S196;
    w_7.s_25 = u32(0);
    w_7.u_1 = u32(0);
    if(_S196)
    {
        var _S197 : u32 = (re_2 * u32(256) + ((ee_2 >> (u32(1))))) / ee_2;
        w_7.s_25 = _S197;
    }
    return w_7;
}

fn chain_weights_0( step_0 : u32) -> Weights_0
{
    var v_5 : u32 = (step_0 & (u32(255)));
    var before_7 : u32 = (((step_0 >> (u32(8)))) & (u32(255)));
    var end_4 : u32 = (((step_0 >> (u32(16)))) & (u32(255)));
    var w_8 : Weights_0;
    w_8.exist_0 = false;
    w_8.s_25 = u32(0);
    w_8.u_1 = u32(0);
    var _S198 : u32 = (step_0 >> (u32(24)));
    if(_S198 != u32(255))
    {
        var _S199 : Weights_0 = affine_weights_0(before_7, end_4, _S198, v_5);
        w_8 = _S199;
    }
    if(!w_8.exist_0)
    {
        var _S200 : Weights_0 = line_weights_0(before_7, end_4, v_5);
        w_8 = _S200;
    }
    return w_8;
}

fn value_at_0( s_26 : u32,  c_6 : u32,  id_8 : u32) -> u32
{
    var _S201 : bool = is_packed_0(s_26);
    if(_S201)
    {
        var _S202 : vec2<u32> = vertex_at_0(s_26, id_8);
        var _S203 : u32 = (extractBits((shared_places_0[s_26]), u32((i32(22))), u32((i32(6)))));
        var _S204 : u32 = c_6 * _S203;
        var _S205 : u32 = (extractBits((shared_places_0[s_26]), u32((i32(22))), u32((i32(6)))));
        return get_field_0(_S202, _S204, _S205);
    }
    var _S206 : u32 = the_values_0;
    var _S207 : u32 = word_of_0(s_26, id_8);
    return all_values_0[_S206 + (_S207 + c_6)];
}

fn affine_point_0( w_9 : Weights_0,  a_2 : u32,  b_2 : u32,  o_1 : u32) -> u32
{
    return a_2 + shift_right_0(w_9.s_25 * (b_2 - a_2) + w_9.u_1 * (o_1 - a_2) + u32(128), u32(8));
}

fn divide_0( x_8 : u32,  n_15 : u32) -> u32
{
    var _S208 : u32 = x_8 / n_15;
    return _S208;
}

fn toward_0( a_3 : u32,  b_3 : u32,  n_16 : u32) -> u32
{
    var _S209 : u32 = divide_0(b_3 - a_3 + ((n_16 >> (u32(1)))) + ((n_16 << (u32(24)))), n_16);
    return a_3 + _S209 - u32(16777216);
}

fn affine_chain_point_0( w_10 : Weights_0,  before_8 : u32,  end_5 : u32,  earlier_0 : u32,  left_0 : u32) -> u32
{
    var _S210 : u32;
    if(w_10.exist_0)
    {
        _S210 = affine_point_0(w_10, before_8, end_5, earlier_0);
    }
    else
    {
        var _S211 : u32 = toward_0(before_8, end_5, left_0);
        _S210 = _S211;
    }
    return _S210;
}

fn next_quotient_0() -> u32
{
    for(;;)
    {
        if((unary_0.window_1) == u32(0))
        {
        }
        else
        {
            break;
        }
        var _S212 : u32 = unary_0.base_4 + u32(32);
        unary_0.base_4 = _S212;
        var _S213 : bool;
        if(((_S212 >> (u32(5)))) >= (push_0.blob_words_0))
        {
            _S213 = true;
        }
        else
        {
            _S213 = (unary_0.base_4 - unary_0.cursor_0) > u32(16415);
        }
        if(_S213)
        {
            error_0 = u32(8);
            return u32(0);
        }
        unary_0.window_1 = load_word_0(((unary_0.base_4) >> (u32(5))));
    }
    var one_0 : u32 = unary_0.base_4 + firstbitlow_0(unary_0.window_1);
    var quotient_1 : u32 = one_0 - unary_0.cursor_0;
    unary_0.window_1 = ((unary_0.window_1) & ((unary_0.window_1 - u32(1))));
    unary_0.cursor_0 = one_0 + u32(1);
    if(quotient_1 > u32(16383))
    {
        error_0 = u32(8);
    }
    return quotient_1;
}

fn is_exponential_0( code_2 : u32) -> bool
{
    return ((code_2 & (u32(4294967264)))) == u32(32);
}

fn exponential_quotient_0( parameter_0 : u32,  q_0 : u32) -> u32
{
    var _S214 : bool;
    if(q_0 <= u32(31))
    {
        _S214 = (parameter_0 + q_0) <= u32(32);
    }
    else
    {
        _S214 = false;
    }
    if(_S214)
    {
        return q_0;
    }
    error_0 = u32(7);
    return u32(0);
}

fn take_low_0( width_1 : u32) -> u32
{
    var w_11 : u32 = (low_position_0 >> (u32(5)));
    if(w_11 != low_index_0)
    {
        var _S215 : u32;
        if(w_11 == (low_index_0 + u32(1)))
        {
            _S215 = low_words_0.y;
        }
        else
        {
            _S215 = load_word_0(w_11);
        }
        low_words_0 = vec2<u32>(_S215, load_word_0(w_11 + u32(1)));
        low_index_0 = w_11;
    }
    var bits_3 : u32 = ((funnel_0(low_words_0.x, low_words_0.y, (low_position_0 & (u32(31))))) & ((word_below_0(width_1))));
    low_position_0 = low_position_0 + width_1;
    return bits_3;
}

fn next_residual_0( c_7 : u32) -> u32
{
    var fixed_code_0 : bool = residual_code_0 == u32(255);
    var parameter_1 : u32 = (residual_code_0 & (u32(31)));
    var width_2 : u32;
    if(fixed_code_0)
    {
        width_2 = get_field_0(residual_widths_0, u32(6) * c_7, u32(6));
    }
    else
    {
        width_2 = parameter_1;
    }
    var above_0 : u32;
    if(fixed_code_0)
    {
        above_0 = u32(0);
    }
    else
    {
        var _S216 : u32 = next_quotient_0();
        above_0 = _S216;
    }
    if(is_exponential_0(residual_code_0))
    {
        var longer_0 : u32 = exponential_quotient_0(parameter_1, above_0);
        var width_3 : u32 = width_2 + longer_0;
        above_0 = ((u32(1) << (longer_0))) - u32(1);
        width_2 = width_3;
    }
    var _S217 : u32 = take_low_0(width_2);
    return unzigzag_0(_S217 + ((above_0 << (parameter_1))));
}

fn read_chain_0( chain_0 : Chain_0,  s_27 : u32)
{
    var _S218 : u32 = (extractBits((shared_stream_0[s_27]), u32((i32(0))), u32((i32(3)))));
    var _S219 : u32 = (extractBits((shared_stream_0[s_27]), u32((i32(9))), u32((i32(3)))));
    var vectors_0 : bool = is_packed_0(s_27);
    var _S220 : u32 = (extractBits((shared_places_0[s_27]), u32((i32(22))), u32((i32(6)))));
    var _S221 : u32 = bits_mask_0(s_27);
    var from_3 : vec2<u32>;
    if(vectors_0)
    {
        var _S222 : vec2<u32> = vertex_at_0(s_27, chain_0.from_0);
        from_3 = _S222;
    }
    else
    {
        from_3 = vec2<u32>(u32(0));
    }
    var _S223 : vec2<u32>;
    if(vectors_0)
    {
        var _S224 : vec2<u32> = vertex_at_0(s_27, chain_0.to_0);
        _S223 = _S224;
    }
    else
    {
        _S223 = vec2<u32>(u32(0));
    }
    var rest_4 : vec2<u32> = chain_0.inner_1;
    var a_4 : u32 = chain_0.from_0;
    var o_2 : u32 = chain_0.from_0;
    var beyond_0 : vec2<u32> = from_3;
    var left_1 : u32 = chain_0.steps_2;
    for(;;)
    {
        var _S225 : bool;
        if(mask_any_0(rest_4))
        {
            _S225 = error_0 == u32(0);
        }
        else
        {
            _S225 = false;
        }
        if(_S225)
        {
        }
        else
        {
            break;
        }
        var _S226 : u32;
        if(chain_0.backwards_0)
        {
            _S226 = mask_msb_0(rest_4);
        }
        else
        {
            _S226 = mask_lsb_0(rest_4);
        }
        var id_9 : u32 = (_S226 & (u32(63)));
        var _S227 : vec2<u32> = (rest_4 & ((~mask_bit_0(id_9))));
        var weights_0 : Weights_0;
        weights_0.exist_0 = false;
        var c_8 : u32;
        if(_S219 == u32(5))
        {
            if(a_4 == (chain_0.from_0))
            {
                c_8 = u32(255);
            }
            else
            {
                c_8 = o_2;
            }
            var _S228 : Weights_0 = chain_weights_0(pack4_0(id_9, a_4, chain_0.to_0, c_8));
            weights_0 = _S228;
        }
        var _S229 : vec2<u32> = vec2<u32>(u32(0));
        c_8 = u32(0);
        var fields_3 : vec2<u32> = _S229;
        for(;;)
        {
            if(c_8 < _S218)
            {
            }
            else
            {
                break;
            }
            var at_5 : u32 = c_8 * _S220;
            var prev_0 : u32;
            if(vectors_0)
            {
                prev_0 = get_field_0(from_3, at_5, _S220);
            }
            else
            {
                var _S230 : u32 = value_at_0(s_27, c_8, a_4);
                prev_0 = _S230;
            }
            var point_0 : u32;
            if(_S219 != u32(2))
            {
                if(vectors_0)
                {
                    point_0 = get_field_0(_S223, at_5, _S220);
                }
                else
                {
                    var _S231 : u32 = value_at_0(s_27, c_8, chain_0.to_0);
                    point_0 = _S231;
                }
                var before_9 : u32;
                if(vectors_0)
                {
                    before_9 = get_field_0(beyond_0, at_5, _S220);
                }
                else
                {
                    var _S232 : u32 = value_at_0(s_27, c_8, o_2);
                    before_9 = _S232;
                }
                var _S233 : u32 = affine_chain_point_0(weights_0, prev_0, point_0, before_9, max(left_1, u32(1)));
                point_0 = _S233;
            }
            else
            {
                point_0 = prev_0;
            }
            var _S234 : u32 = next_residual_0(c_8);
            var value_8 : u32 = ((point_0 + _S234) & (_S221));
            if(vectors_0)
            {
                fields_3 = (fields_3 | ((put_field_0(at_5, value_8))));
            }
            else
            {
                put_value_0(s_27, c_8, id_9, value_8);
            }
            c_8 = c_8 + u32(1);
        }
        if(vectors_0)
        {
            put_vertex_0(s_27, id_9, fields_3);
        }
        var _S235 : u32 = left_1 - u32(1);
        rest_4 = _S227;
        o_2 = a_4;
        a_4 = id_9;
        beyond_0 = from_3;
        from_3 = fields_3;
        left_1 = _S235;
    }
    return;
}

fn read_stream_0( h_32 : Header_0,  r_21 : u32,  run_3 : Run_0,  wanted_1 : u32)
{
    if(mask_test_0(seam_references_0(h_32, wanted_1), r_21))
    {
        return;
    }
    var _S236 : Source_0 = source_of_0(h_32, r_21);
    var source_0 : Source_0 = _S236;
    var code_3 : u32 = u32(0);
    var widths_10 : u32 = u32(0);
    var n_17 : u32 = u32(0);
    var s_28 : u32 = u32(0);
    var ones_4 : u32 = u32(0);
    for(;;)
    {
        if(s_28 <= wanted_1)
        {
        }
        else
        {
            break;
        }
        var n_18 : u32 = (extractBits((shared_stream_0[s_28]), u32((i32(0))), u32((i32(3)))));
        var _S237 : u32 = source_0.codes_3;
        var code_4 : u32 = code_at_2(&(_S237), s_28, true);
        var widths_11 : u32 = _S237 - u32(5) * n_18;
        var _S238 : u32 = _S237;
        var _S239 : u32 = code_at_2(&(_S238), s_28, false);
        source_0.codes_3 = _S238;
        var before_10 : u32;
        if(s_28 < wanted_1)
        {
            before_10 = source_0.total_0;
        }
        else
        {
            before_10 = source_0.first_2;
        }
        source_0.low_4 = source_0.low_4 + before_10 * low_width_0(code_4, n_18, widths_11);
        if(code_4 != u32(255))
        {
            ones_4 = ones_4 + before_10 * n_18;
        }
        var _S240 : u32 = s_28 + u32(1);
        code_3 = code_4;
        widths_10 = widths_11;
        n_17 = n_18;
        s_28 = _S240;
    }
    residual_code_0 = code_3;
    var _S241 : bool = code_3 == u32(255);
    var _S242 : vec2<u32>;
    if(_S241)
    {
        _S242 = fixed_widths_0(widths_10, n_17);
    }
    else
    {
        _S242 = vec2<u32>(u32(0));
    }
    residual_widths_0 = _S242;
    if(_S241)
    {
        code_3 = source_0.quotients_1;
    }
    else
    {
        var _S243 : u32 = after_ones_0(source_0.quotients_1, ones_4);
        code_3 = _S243;
    }
    unary_0 = seek_unary_0(code_3);
    seek_low_0(source_0.low_4);
    if(error_0 == u32(0))
    {
        read_chain_0(chain_of_0(h_32, r_21, run_3), wanted_1);
    }
    if((max(unary_0.cursor_0, low_position_0)) > (u32(8) * (byte_length_0 - u32(8))))
    {
        error_0 = u32(8);
    }
    return;
}

fn next_stream_0( s_29 : u32) -> u32
{
    if((the_workgroup_0.y) > u32(0))
    {
        return stream_end_0;
    }
    var _S244 : u32 = s_29 + u32(1);
    for(;;)
    {
        if(_S244 < stream_end_0)
        {
        }
        else
        {
            break;
        }
        var _S245 : u32 = (extractBits((shared_stream_0[_S244]), u32((i32(9))), u32((i32(3)))));
        if(_S245 == u32(5))
        {
            break;
        }
        _S244 = _S244 + u32(1);
    }
    return _S244;
}

fn chains_shader_0()
{
    var _S246 : bool = open_pass_0(u32(8));
    if(!_S246)
    {
        return;
    }
    var _S247 : Header_0 = open_header_0();
    var r_22 : u32 = first_item_0;
    for(;;)
    {
        if(r_22 < (_S247.references_1))
        {
        }
        else
        {
            break;
        }
        var run_4 : Run_0 = run_of_0(r_22);
        var _S248 : bool;
        if(mask_test_0(_S247.private_refs_1, r_22))
        {
            _S248 = true;
        }
        else
        {
            _S248 = (run_4.steps_0) < u32(2);
        }
        if(_S248)
        {
            r_22 = r_22 + u32(8);
            continue;
        }
        var _S249 : u32 = first_stream_0();
        var s_30 : u32 = _S249;
        for(;;)
        {
            var _S250 : bool;
            if(s_30 < stream_end_0)
            {
                _S250 = error_0 == u32(0);
            }
            else
            {
                _S250 = false;
            }
            if(_S250)
            {
            }
            else
            {
                break;
            }
            read_stream_0(_S247, r_22, run_4, s_30);
            var _S251 : u32 = next_stream_0(s_30);
            s_30 = _S251;
        }
        r_22 = r_22 + u32(8);
    }
    close_pass_0();
    return;
}

@compute
@workgroup_size(64, 1, 1)
fn chains_main(@builtin(local_invocation_index) thread_2 : u32, @builtin(workgroup_id) workgroup_2 : vec3<u32>, @builtin(global_invocation_id) invocation_2 : vec3<u32>)
{
    the_thread_0 = thread_2;
    the_workgroup_0 = workgroup_2;
    the_invocation_0 = invocation_2;
    chains_shader_0();
    return;
}

fn seam_vertices_0( h_33 : Header_0,  s_31 : u32) -> u32
{
    var rest_5 : vec2<u32> = seam_references_0(h_33, s_31);
    var count_9 : u32 = u32(0);
    for(;;)
    {
        if(mask_any_0(rest_5))
        {
        }
        else
        {
            break;
        }
        var count_10 : u32 = count_9 + (run_of_0(mask_lsb_0(rest_5)).steps_0 - u32(1));
        rest_5 = mask_clear_lsb_0(rest_5);
        count_9 = count_10;
    }
    return min(count_9, u32(64));
}

fn low_size_0( code_5 : u32,  elements_2 : u32,  widths_12 : u32,  n_19 : u32,  zeros_0 : u32) -> u32
{
    if(code_5 == u32(255))
    {
        var _S252 : u32 = n_19 / elements_2;
        return _S252 * fixed_width_0(elements_2, widths_12);
    }
    var _S253 : u32 = n_19 * ((code_5 & (u32(31))));
    var _S254 : u32;
    if(is_exponential_0(code_5))
    {
        _S254 = zeros_0;
    }
    else
    {
        _S254 = u32(0);
    }
    return _S253 + _S254;
}

fn seek_residuals_0( h_34 : Header_0,  interior_2 : u32,  stream_1 : u32,  traversed_0 : u32)
{
    var codes_5 : u32 = h_34.codes_1;
    var _S255 : bool = mask_any_0(h_34.owned_refs_0);
    var _S256 : u32;
    if(stream_1 == u32(0))
    {
        _S256 = u32(1);
    }
    else
    {
        _S256 = stream_total_0;
    }
    var begin_2 : u32 = interior_2;
    var s_32 : u32 = u32(0);
    var p_18 : u32 = interior_2;
    var low_6 : u32 = u32(0);
    for(;;)
    {
        if(s_32 < _S256)
        {
        }
        else
        {
            break;
        }
        var n_20 : u32 = (extractBits((shared_stream_0[s_32]), u32((i32(0))), u32((i32(3)))));
        if(_S255)
        {
            var _S257 : u32 = code_at_1(&(codes_5), s_32, true);
        }
        var code_6 : u32 = code_at_1(&(codes_5), s_32, false);
        var widths_13 : u32 = codes_5 - u32(5) * n_20;
        var _S258 : u32 = min(traversed_0 + seam_vertices_0(h_34, s_32), u32(64));
        var _S259 : bool = code_6 == u32(255);
        var ones_5 : u32;
        if(_S259)
        {
            ones_5 = u32(0);
        }
        else
        {
            ones_5 = _S258 * n_20;
        }
        var next_0 : u32 = after_ones_0(p_18, ones_5);
        if(s_32 == stream_1)
        {
            residual_code_0 = code_6;
            var _S260 : vec2<u32>;
            if(_S259)
            {
                _S260 = fixed_widths_0(widths_13, n_20);
            }
            else
            {
                _S260 = vec2<u32>(u32(0));
            }
            residual_widths_0 = _S260;
            begin_2 = p_18;
        }
        var size_0 : u32 = low_size_0(code_6, n_20, widths_13, _S258 * n_20, next_0 - p_18 - ones_5);
        var low_7 : u32;
        if(s_32 < stream_1)
        {
            low_7 = low_6 + size_0;
        }
        else
        {
            low_7 = low_6;
        }
        var _S261 : bool;
        if(s_32 == u32(0))
        {
            _S261 = stream_1 != u32(0);
        }
        else
        {
            _S261 = false;
        }
        if(_S261)
        {
            p_18 = next_0 + low_7;
            low_6 = u32(0);
        }
        else
        {
            p_18 = next_0;
            low_6 = low_7;
        }
        s_32 = s_32 + u32(1);
    }
    seek_low_0(p_18 + low_6);
    unary_0 = seek_unary_0(begin_2);
    return;
}

fn read_seams_0( h_35 : Header_0,  s_33 : u32)
{
    var rest_6 : vec2<u32> = seam_references_0(h_35, s_33);
    for(;;)
    {
        if(mask_any_0(rest_6))
        {
        }
        else
        {
            break;
        }
        var r_23 : u32 = mask_lsb_0(rest_6);
        var run_5 : Run_0 = run_of_0(r_23);
        read_chain_0(Chain_x24init_0(run_5.steps_0, id_at_0(run_5.rank_8), last_id_0(h_35, r_23, run_5), inner_ids_0(run_5), false), s_33);
        rest_6 = mask_clear_lsb_0(rest_6);
    }
    return;
}

fn job_triangles_0() -> u32
{
    return u32(64) * job_place_0;
}

fn traversed_weights_0( triangle_0 : u32) -> Weights_0
{
    var w_12 : Weights_0;
    w_12.exist_0 = false;
    w_12.s_25 = u32(0);
    w_12.u_1 = u32(0);
    var _S262 : u32 = (triangle_0 >> (u32(24)));
    if(_S262 != u32(255))
    {
        var _S263 : Weights_0 = affine_weights_0((triangle_0 & (u32(255))), (((triangle_0 >> (u32(8)))) & (u32(255))), _S262, (((triangle_0 >> (u32(16)))) & (u32(255))));
        w_12 = _S263;
    }
    return w_12;
}

fn traversed_prediction_0( predictor_0 : u32,  a_5 : u32,  b_4 : u32,  o_3 : u32,  across_0 : bool) -> u32
{
    if(predictor_0 == u32(2))
    {
        return a_5;
    }
    var sum_2 : u32 = a_5 + b_4;
    var _S264 : bool;
    if(predictor_0 == u32(1))
    {
        _S264 = true;
    }
    else
    {
        _S264 = !across_0;
    }
    if(_S264)
    {
        return (sum_2 >> (u32(1)));
    }
    if(predictor_0 == u32(3))
    {
        return u32((i32(u32(3) * sum_2 - u32(2) * o_3 + u32(2)) >> (u32(2))));
    }
    return sum_2 - o_3;
}

fn read_traversed_0( s_34 : u32,  triangle_1 : u32)
{
    var _S265 : u32 = (extractBits((shared_stream_0[s_34]), u32((i32(0))), u32((i32(3)))));
    var predictor_1 : u32 = (extractBits((shared_stream_0[s_34]), u32((i32(9))), u32((i32(3)))));
    var predicted_0 : bool = predictor_1 != u32(4);
    var a_6 : u32 = (triangle_1 & (u32(63)));
    var b_5 : u32 = (((triangle_1 >> (u32(8)))) & (u32(63)));
    var v_6 : u32 = (((triangle_1 >> (u32(16)))) & (u32(63)));
    var _S266 : u32 = (triangle_1 >> (u32(24)));
    var o_4 : u32 = (_S266 & (u32(63)));
    var _S267 : bool = _S266 != u32(255);
    var vectors_1 : bool = is_packed_0(s_34);
    var _S268 : u32 = (extractBits((shared_places_0[s_34]), u32((i32(22))), u32((i32(6)))));
    var _S269 : u32 = bits_mask_0(s_34);
    var loads_0 : bool;
    if(vectors_1)
    {
        loads_0 = predicted_0;
    }
    else
    {
        loads_0 = false;
    }
    var _S270 : vec2<u32>;
    if(loads_0)
    {
        var _S271 : vec2<u32> = vertex_at_0(s_34, a_6);
        _S270 = _S271;
    }
    else
    {
        _S270 = vec2<u32>(u32(0));
    }
    var _S272 : vec2<u32>;
    if(loads_0)
    {
        var _S273 : vec2<u32> = vertex_at_0(s_34, b_5);
        _S272 = _S273;
    }
    else
    {
        _S272 = vec2<u32>(u32(0));
    }
    var _S274 : vec2<u32>;
    if(loads_0)
    {
        var _S275 : vec2<u32> = vertex_at_0(s_34, o_4);
        _S274 = _S275;
    }
    else
    {
        _S274 = vec2<u32>(u32(0));
    }
    var weights_1 : Weights_0;
    weights_1.exist_0 = false;
    if(predictor_1 == u32(5))
    {
        var _S276 : Weights_0 = traversed_weights_0(triangle_1);
        weights_1 = _S276;
    }
    var _S277 : vec2<u32> = vec2<u32>(u32(0));
    var c_9 : u32 = u32(0);
    var fields_4 : vec2<u32> = _S277;
    for(;;)
    {
        if(c_9 < _S265)
        {
        }
        else
        {
            break;
        }
        var at_6 : u32 = c_9 * _S268;
        var value_9 : u32 = next_residual_0(c_9);
        var value_10 : u32;
        if(predicted_0)
        {
            var known_0 : vec3<u32>;
            if(vectors_1)
            {
                known_0 = vec3<u32>(get_field_0(_S270, at_6, _S268), get_field_0(_S272, at_6, _S268), get_field_0(_S274, at_6, _S268));
            }
            else
            {
                var _S278 : u32 = value_at_0(s_34, c_9, a_6);
                var _S279 : u32 = value_at_0(s_34, c_9, b_5);
                var _S280 : u32 = value_at_0(s_34, c_9, o_4);
                known_0 = vec3<u32>(_S278, _S279, _S280);
            }
            var _S281 : u32 = known_0.x;
            var _S282 : u32 = known_0.y;
            var _S283 : u32 = known_0.z;
            var simple_0 : u32 = traversed_prediction_0(predictor_1, _S281, _S282, _S283, _S267);
            if(weights_1.exist_0)
            {
                value_10 = affine_point_0(weights_1, _S281, _S282, _S283);
            }
            else
            {
                value_10 = simple_0;
            }
            value_10 = value_9 + value_10;
        }
        else
        {
            value_10 = value_9;
        }
        if(vectors_1)
        {
            fields_4 = (fields_4 | ((put_field_0(at_6, (value_10 & (_S269))))));
        }
        else
        {
            put_value_0(s_34, c_9, v_6, value_10);
        }
        c_9 = c_9 + u32(1);
    }
    if(vectors_1)
    {
        put_vertex_0(s_34, v_6, fields_4);
    }
    return;
}

fn read_all_traversed_0( s_35 : u32,  waiting_2 : vec2<u32>)
{
    var rest_7 : vec2<u32>;
    if(mask_any_0(waiting_2))
    {
        rest_7 = mask_below_0(triangle_count_0);
    }
    else
    {
        rest_7 = symbol_c_0;
    }
    var following_0 : u32 = all_triangles_0[job_triangles_0() + (((mask_lsb_0(rest_7)) & (u32(63))))];
    var _S284 : vec2<u32> = waiting_2;
    for(;;)
    {
        var _S285 : bool;
        if(mask_any_0(rest_7))
        {
            _S285 = error_0 == u32(0);
        }
        else
        {
            _S285 = false;
        }
        if(_S285)
        {
        }
        else
        {
            break;
        }
        var t_1 : u32 = mask_lsb_0(rest_7);
        var a_7 : u32 = (following_0 & (u32(63)));
        var b_6 : u32 = (((following_0 >> (u32(8)))) & (u32(63)));
        var v_7 : u32 = (((following_0 >> (u32(16)))) & (u32(63)));
        var _S286 : bool;
        if(mask_test_0(the_starts_0, t_1))
        {
            _S286 = mask_test_0(_S284, a_7);
        }
        else
        {
            _S286 = false;
        }
        var triangle_2 : u32;
        var introduces_0 : bool;
        if(_S286)
        {
            var _S287 : vec2<u32> = (_S284 & ((~mask_bit_0(a_7))));
            var _S288 : u32 = pack4_0(b_6, b_6, a_7, b_6);
            introduces_0 = true;
            triangle_2 = _S288;
            _S284 = _S287;
        }
        else
        {
            var rest_8 : vec2<u32> = mask_clear_lsb_0(rest_7);
            var _S289 : u32 = all_triangles_0[job_triangles_0() + (((mask_lsb_0(rest_8)) & (u32(63))))];
            if(mask_test_0(symbol_c_0, t_1))
            {
                introduces_0 = true;
            }
            else
            {
                introduces_0 = mask_test_0(_S284, v_7);
            }
            var _S290 : vec2<u32> = (_S284 & ((~mask_bit_0(v_7))));
            triangle_2 = following_0;
            rest_7 = rest_8;
            following_0 = _S289;
            _S284 = _S290;
        }
        if(introduces_0)
        {
            read_traversed_0(s_35, triangle_2);
        }
    }
    if(mask_any_0(_S284))
    {
        error_0 = u32(2);
    }
    return;
}

fn traversal_shader_0()
{
    var _S291 : bool = open_pass_0(u32(1));
    if(!_S291)
    {
        return;
    }
    var _S292 : Header_0 = open_header_0();
    var places_2 : Places_std430_0 = all_places_0[job_meshlet_0];
    if((all_places_0[job_meshlet_0].interior_0) == u32(4294967295))
    {
        return;
    }
    var _S293 : u32 = mask_count_0(symbol_c_0) + mask_count_0(places_2.waiting_0);
    var _S294 : u32 = first_stream_0();
    var s_36 : u32 = _S294;
    for(;;)
    {
        var _S295 : bool;
        if(s_36 < stream_end_0)
        {
            _S295 = error_0 == u32(0);
        }
        else
        {
            _S295 = false;
        }
        if(_S295)
        {
        }
        else
        {
            break;
        }
        seek_residuals_0(_S292, places_2.interior_0, s_36, _S293);
        read_seams_0(_S292, s_36);
        read_all_traversed_0(s_36, places_2.waiting_0);
        if((max(unary_0.cursor_0, low_position_0)) > (u32(8) * (byte_length_0 - u32(8))))
        {
            error_0 = u32(8);
        }
        var _S296 : u32 = next_stream_0(s_36);
        s_36 = _S296;
    }
    close_pass_0();
    return;
}

@compute
@workgroup_size(64, 1, 1)
fn traversal_main(@builtin(local_invocation_index) thread_3 : u32, @builtin(workgroup_id) workgroup_3 : vec3<u32>, @builtin(global_invocation_id) invocation_3 : vec3<u32>)
{
    the_thread_0 = thread_3;
    the_workgroup_0 = workgroup_3;
    the_invocation_0 = invocation_3;
    traversal_shader_0();
    return;
}

var<workgroup> shared_normals_0 : array<array<atomic<u32>, i32(192)>, i32(2)>;

fn geo_shift_0() -> u32
{
    var _S297 : u32 = (extractBits((shared_stream_0[u32(0)]), u32((i32(3))), u32((i32(6)))));
    return excess_0(_S297, u32(13));
}

fn triangle_normal_0( triangle_3 : u32,  h_36 : u32) -> Triple_0
{
    var _S298 : Triple_0 = grid_position_0((triangle_3 & (u32(63))));
    var a_8 : Triple_0 = shifted_0(_S298, h_36);
    var _S299 : Triple_0 = grid_position_0((((triangle_3 >> (u32(8)))) & (u32(63))));
    var e_4 : Triple_0 = difference_0(shifted_0(_S299, h_36), a_8);
    var _S300 : Triple_0 = grid_position_0((((triangle_3 >> (u32(16)))) & (u32(63))));
    var f_2 : Triple_0 = difference_0(shifted_0(_S300, h_36), a_8);
    var n_21 : Triple_0;
    n_21.x_1 = e_4.y_1 * f_2.z_1 - e_4.z_1 * f_2.y_1;
    n_21.y_1 = e_4.z_1 * f_2.x_1 - e_4.x_1 * f_2.z_1;
    n_21.z_1 = e_4.x_1 * f_2.y_1 - e_4.y_1 * f_2.x_1;
    return n_21;
}

fn add_triangle_0( triangle_4 : u32,  wanted_2 : vec2<u32>)
{
    var _S301 : u32 = geo_shift_0();
    var _S302 : Triple_0 = triangle_normal_0(triangle_4, _S301);
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
        var id_10 : u32 = (((triangle_4 >> ((u32(8) * corner_0)))) & (u32(63)));
        if(!mask_test_0(wanted_2, id_10))
        {
            corner_0 = corner_0 + u32(1);
            continue;
        }
        var place_1 : u32 = u32(3) * id_10;
        var _S303 : u32 = atomicAdd(&(shared_normals_0[member_0][place_1]), _S302.x_1);
        var _S304 : u32 = atomicAdd(&(shared_normals_0[member_0][place_1 + u32(1)]), _S302.y_1);
        var _S305 : u32 = atomicAdd(&(shared_normals_0[member_0][place_1 + u32(2)]), _S302.z_1);
        corner_0 = corner_0 + u32(1);
    }
    return;
}

struct OctPair_0
{
     u_2 : u32,
     v_8 : u32,
};

fn octahedral_prediction_0( normal_x_0 : u32,  normal_y_0 : u32,  normal_z_0 : u32,  bits_4 : u32) -> OctPair_0
{
    var n_22 : Triple_0;
    n_22.x_1 = normal_x_0;
    n_22.y_1 = normal_y_0;
    n_22.z_1 = normal_z_0;
    var k_5 : u32 = excess_0(bit_length_0(magnitudes_0(n_22)), u32(13));
    var limit_0 : u32 = ((u32(1) << (bits_4))) - u32(2);
    var x_9 : u32 = ((magnitude_0(normal_x_0)) >> (k_5));
    var y_4 : u32 = ((magnitude_0(normal_y_0)) >> (k_5));
    var sum_3 : u32 = x_9 + y_4 + (((magnitude_0(normal_z_0)) >> (k_5)));
    var q_1 : OctPair_0;
    var _S306 : u32 = (limit_0 >> (u32(1)));
    q_1.u_2 = _S306;
    q_1.v_8 = _S306;
    if(sum_3 == u32(0))
    {
        return q_1;
    }
    var below_0 : bool = i32(n_22.z_1) < i32(0);
    var u_3 : u32;
    if(below_0)
    {
        u_3 = sum_3 - y_4;
    }
    else
    {
        u_3 = x_9;
    }
    var v_9 : u32;
    if(below_0)
    {
        v_9 = sum_3 - x_9;
    }
    else
    {
        v_9 = y_4;
    }
    if(i32(n_22.x_1) < i32(0))
    {
        u_3 = sum_3 - u_3;
    }
    else
    {
        u_3 = sum_3 + u_3;
    }
    if(i32(n_22.y_1) < i32(0))
    {
        v_9 = sum_3 - v_9;
    }
    else
    {
        v_9 = sum_3 + v_9;
    }
    var _S307 : u32 = u32(2) * sum_3;
    var _S308 : u32 = (u_3 * limit_0 + sum_3) / _S307;
    q_1.u_2 = _S308;
    var _S309 : u32 = (v_9 * limit_0 + sum_3) / _S307;
    q_1.v_8 = _S309;
    return q_1;
}

fn add_prediction_0( s_37 : u32,  id_11 : u32)
{
    var _S310 : u32 = u32(3) * id_11;
    var _S311 : u32 = atomicLoad(&(shared_normals_0[member_0][_S310]));
    var _S312 : u32 = atomicLoad(&(shared_normals_0[member_0][_S310 + u32(1)]));
    var _S313 : u32 = atomicLoad(&(shared_normals_0[member_0][_S310 + u32(2)]));
    var _S314 : u32 = (extractBits((shared_stream_0[s_37]), u32((i32(3))), u32((i32(6)))));
    var point_1 : OctPair_0 = octahedral_prediction_0(_S311, _S312, _S313, (_S314 & (u32(31))));
    var field_6 : u32 = (extractBits((shared_places_0[s_37]), u32((i32(22))), u32((i32(6)))));
    var residuals_0 : vec2<u32> = vertex_at_0(s_37, id_11);
    var _S315 : u32 = point_1.u_2 + get_field_0(residuals_0, u32(0), field_6);
    var _S316 : u32 = bits_mask_0(s_37);
    var u_4 : u32 = (_S315 & (_S316));
    var _S317 : u32 = point_1.v_8 + get_field_0(residuals_0, field_6, field_6);
    var _S318 : u32 = bits_mask_0(s_37);
    put_vertex_0(s_37, id_11, ((put_field_0(u32(0), u_4)) | ((put_field_0(field_6, (_S317 & (_S318)))))));
    return;
}

fn geo_shader_0()
{
    var live_2 : bool = open_pass_0(u32(32));
    var summary_1 : u32 = atomicLoad(&(the_summaries_0[job_place_0]));
    var s_38 : u32;
    if(live_2)
    {
        s_38 = min((summary_1 & (u32(127))), u32(64));
    }
    else
    {
        s_38 = u32(0);
    }
    var _S319 : vec2<u32> = mask_none_0();
    var wanted_3 : vec2<u32>;
    if(live_2)
    {
        wanted_3 = ((mask_below_0((((summary_1 >> (u32(8)))) & (u32(127))))) & ((~((the_boundary_0 & ((~all_places_0[job_meshlet_0].waiting_0)))))));
    }
    else
    {
        wanted_3 = _S319;
    }
    var i_9 : u32 = first_item_0;
    for(;;)
    {
        if(i_9 < u32(192))
        {
        }
        else
        {
            break;
        }
        atomicStore(&(shared_normals_0[member_0][i_9]), u32(0));
        i_9 = i_9 + u32(32);
    }
    workgroupBarrier();
    var t_2 : u32 = first_item_0;
    for(;;)
    {
        if(t_2 < s_38)
        {
        }
        else
        {
            break;
        }
        add_triangle_0(all_triangles_0[job_triangles_0() + t_2], wanted_3);
        t_2 = t_2 + u32(32);
    }
    workgroupBarrier();
    i_9 = first_item_0;
    for(;;)
    {
        if(i_9 < (mask_count_0(wanted_3)))
        {
        }
        else
        {
            break;
        }
        var _S320 : u32 = nth_bit_0(wanted_3, i_9);
        s_38 = u32(1);
        for(;;)
        {
            if(s_38 < stream_end_0)
            {
            }
            else
            {
                break;
            }
            var _S321 : u32 = (extractBits((shared_stream_0[s_38]), u32((i32(9))), u32((i32(3)))));
            if(_S321 == u32(4))
            {
                add_prediction_0(s_38, _S320);
            }
            s_38 = s_38 + u32(1);
        }
        i_9 = i_9 + u32(32);
    }
    return;
}

@compute
@workgroup_size(64, 1, 1)
fn geo_main(@builtin(local_invocation_index) thread_4 : u32, @builtin(workgroup_id) workgroup_4 : vec3<u32>, @builtin(global_invocation_id) invocation_4 : vec3<u32>)
{
    the_thread_0 = thread_4;
    the_workgroup_0 = workgroup_4;
    the_invocation_0 = invocation_4;
    geo_shader_0();
    return;
}

