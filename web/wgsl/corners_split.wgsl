// Translated from shaders/decoders/corners.comp by web/build_wgsl.py: do not edit.
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

@binding(4) @group(0) var<storage, read_write> all_values_0 : array<u32>;

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

var<workgroup> group_hops_0 : u32;

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

fn mask_count_0( m_2 : vec2<u32>) -> u32
{
    return countOneBits(m_2.x) + countOneBits(m_2.y);
}

fn nth_bit_0( m_3 : vec2<u32>,  n_2 : u32) -> u32
{
    var _S32 : u32 = m_3.x;
    var low_0 : u32 = countOneBits(_S32);
    var _S33 : bool = n_2 < low_0;
    var half_width_0 : u32;
    if(_S33)
    {
        half_width_0 = u32(0);
    }
    else
    {
        half_width_0 = u32(32);
    }
    var word_0 : u32;
    if(_S33)
    {
        word_0 = _S32;
    }
    else
    {
        word_0 = m_3.y;
    }
    var _S34 : u32;
    if(n_2 >= low_0)
    {
        _S34 = n_2 - low_0;
    }
    else
    {
        _S34 = n_2;
    }
    var _S35 : u32 = half_width_0;
    half_width_0 = u32(16);
    var at_0 : u32 = _S35;
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
        if(_S34 >= ones_0)
        {
            var _S36 : u32 = _S34 - ones_0;
            var at_1 : u32 = at_0 + half_width_0;
            word_0 = (word_0 >> (half_width_0));
            _S34 = _S36;
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

fn id_at_0( rank_0 : u32) -> u32
{
    return nth_bit_0(the_boundary_0, rank_0);
}

fn mask_none_0() -> vec2<u32>
{
    return vec2<u32>(u32(0));
}

fn mask_any_0( m_4 : vec2<u32>) -> bool
{
    return (((m_4.x) | ((m_4.y)))) != u32(0);
}

fn load_words2_0( i_4 : u32) -> vec2<u32>
{
    return vec2<u32>(load_memory_0(i_4), load_memory_0(i_4 + u32(1)));
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

fn mask_lsb_0( m_5 : vec2<u32>) -> u32
{
    var _S37 : u32 = m_5.x;
    var _S38 : u32;
    if(_S37 != u32(0))
    {
        _S38 = firstbitlow_0(_S37);
    }
    else
    {
        var _S39 : u32 = m_5.y;
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

fn seam_references_0( h_2 : Header_0,  s_4 : u32) -> vec2<u32>
{
    var seams_0 : vec2<u32> = mask_none_0();
    var _S43 : bool;
    if(s_4 == u32(0))
    {
        _S43 = true;
    }
    else
    {
        _S43 = (((h_2.flags_0) & (u32(4)))) == u32(0);
    }
    if(_S43)
    {
        return seams_0;
    }
    var _S44 : u32 = h_2.entries_1 + h_2.delta_width_0 + h_2.slot_width_0 + s_4 - u32(1);
    var rest_0 : vec2<u32> = h_2.foreign_refs_1;
    var seams_1 : vec2<u32> = seams_0;
    var share_0 : u32 = _S44;
    for(;;)
    {
        if(mask_any_0(rest_0))
        {
        }
        else
        {
            break;
        }
        if((load_bits_0(share_0, u32(1))) == u32(0))
        {
            seams_1 = (seams_1 | ((mask_bit_0(mask_lsb_0(rest_0)))));
        }
        var share_1 : u32 = share_0 + h_2.entry_width_0;
        rest_0 = mask_clear_lsb_0(rest_0);
        share_0 = share_1;
    }
    return seams_1;
}

fn mask_msb_0( m_7 : vec2<u32>) -> u32
{
    var _S45 : u32 = m_7.y;
    var _S46 : u32;
    if(_S45 != u32(0))
    {
        _S46 = u32(32) + firstbithigh_0(_S45);
    }
    else
    {
        var _S47 : u32 = m_7.x;
        if(_S47 != u32(0))
        {
            _S46 = firstbithigh_0(_S47);
        }
        else
        {
            _S46 = u32(64);
        }
    }
    return _S46;
}

fn loop_begin_0( h_3 : Header_0,  r_0 : u32) -> u32
{
    var before_2 : vec2<u32> = ((h_3.loop_ends_2) & ((mask_below_0(r_0))));
    var _S48 : u32;
    if(mask_any_0(before_2))
    {
        _S48 = mask_msb_0(before_2) + u32(1);
    }
    else
    {
        _S48 = u32(0);
    }
    return _S48;
}

fn previous_reference_0( h_4 : Header_0,  r_1 : u32) -> u32
{
    var _S49 : u32;
    if(r_1 == (loop_begin_0(h_4, r_1)))
    {
        _S49 = mask_lsb_0(((h_4.loop_ends_2) & ((~mask_below_0(r_1)))));
    }
    else
    {
        _S49 = r_1 - u32(1);
    }
    return _S49;
}

fn mask_test_0( m_8 : vec2<u32>,  i_5 : u32) -> bool
{
    var _S50 : u32;
    if(((i_5 & (u32(32)))) == u32(0))
    {
        _S50 = m_8.x;
    }
    else
    {
        _S50 = m_8.y;
    }
    return ((((_S50 >> (((i_5 & (u32(31))))))) & (u32(1)))) != u32(0);
}

fn stored_corners_0( h_5 : Header_0,  seams_2 : vec2<u32>) -> vec2<u32>
{
    var own_0 : vec2<u32> = ((((mask_below_0(h_5.references_1)) & ((~h_5.foreign_refs_1)))) | (seams_2));
    var _S51 : vec2<u32> = mask_shl1_0((own_0 & ((~h_5.loop_ends_2))));
    var rest_1 : vec2<u32> = h_5.loop_ends_2;
    var before_3 : vec2<u32> = _S51;
    var first_1 : u32 = u32(0);
    for(;;)
    {
        if(mask_any_0(rest_1))
        {
        }
        else
        {
            break;
        }
        var last_0 : u32 = mask_lsb_0(rest_1);
        if(mask_test_0(own_0, last_0))
        {
            before_3 = (before_3 | ((mask_bit_0(first_1))));
        }
        var _S52 : u32 = last_0 + u32(1);
        rest_1 = mask_clear_lsb_0(rest_1);
        first_1 = _S52;
    }
    return (own_0 & (before_3));
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
    var _S53 : Places_0 = Places_0( all_places_0[m_9].foreign_refs_0, all_places_0[m_9].private_refs_0, all_places_0[m_9].loop_ends_0, all_places_0[m_9].counts_0, all_places_0[m_9].lengths_0, all_places_0[m_9].entries_0, all_places_0[m_9].codes_0, all_places_0[m_9].anchors_0, all_places_0[m_9].chains_0, all_places_0[m_9].quotients_0, all_places_0[m_9].interior_0, all_places_0[m_9].waiting_0 );
    if((all_places_0[m_9].quotients_0) == u32(4294967295))
    {
        error_0 = u32(7);
    }
    return _S53;
}

fn anchors_of_0( h_6 : Header_0,  s_5 : u32,  count_0 : u32) -> u32
{
    var _S54 : bool;
    if((h_6.references_1) == u32(0))
    {
        _S54 = true;
    }
    else
    {
        if(s_5 > u32(0))
        {
            _S54 = (((h_6.flags_0) & (u32(4)))) == u32(0);
        }
        else
        {
            _S54 = false;
        }
    }
    if(_S54)
    {
        return count_0;
    }
    return mask_count_0(stored_corners_0(h_6, seam_references_0(h_6, s_5)));
}

fn anchor_widths_0( s_6 : u32,  p_1 : u32) -> u32
{
    var n_4 : u32 = (extractBits((group_stream_0[s_6]), u32((i32(0))), u32((i32(3)))));
    var _S55 : u32 = (extractBits((group_stream_0[s_6]), u32((i32(3))), u32((i32(6)))));
    var _S56 : u32 = load_bits_0(p_1, u32(3) * n_4);
    var c_0 : u32 = u32(0);
    var widths_0 : u32 = u32(0);
    for(;;)
    {
        if(c_0 < n_4)
        {
        }
        else
        {
            break;
        }
        var field_2 : u32 = (extractBits((_S56), u32((i32(u32(3) * c_0))), u32((i32(3)))));
        var width_0 : u32;
        if(field_2 == u32(7))
        {
            width_0 = _S55;
        }
        else
        {
            var _S57 : u32 = (extractBits((group_bases_0[s_6]), u32((i32(16))), u32((i32(5)))));
            width_0 = min(_S57 + field_2, _S55);
        }
        var widths_1 : u32 = (widths_0 | (((width_0 << ((u32(6) * c_0))))));
        c_0 = c_0 + u32(1);
        widths_0 = widths_1;
    }
    return widths_0;
}

fn further_widths_0( p_2 : u32,  s_7 : u32,  count_1 : u32) -> u32
{
    var n_5 : u32 = (extractBits((group_stream_0[s_7]), u32((i32(0))), u32((i32(3)))));
    var _S58 : u32;
    if(count_1 > u32(1))
    {
        var _S59 : u32 = (extractBits((group_stream_0[s_7]), u32((i32(3))), u32((i32(6)))));
        var _S60 : u32 = anchor_widths_0(s_7, p_2 + n_5 * _S59);
        _S58 = _S60;
    }
    else
    {
        _S58 = u32(0);
    }
    return _S58;
}

fn width_sum_0( widths_2 : u32) -> u32
{
    return ((widths_2 & (u32(63)))) + ((((widths_2 >> (u32(6)))) & (u32(63)))) + ((((widths_2 >> (u32(12)))) & (u32(63)))) + ((widths_2 >> (u32(18))));
}

fn unzigzag_0( u_0 : u32) -> u32
{
    return (((u_0 >> (u32(1)))) ^ ((u32(0) - ((u_0 & (u32(1)))))));
}

fn bits_mask_0( s_8 : u32) -> u32
{
    var _S61 : u32 = (extractBits((group_stream_0[s_8]), u32((i32(3))), u32((i32(6)))));
    return word_below_0(_S61);
}

fn anchor_value_0( s_9 : u32,  p_3 : u32,  index_0 : u32,  widths_3 : u32,  c_1 : u32) -> u32
{
    var n_6 : u32 = (extractBits((group_stream_0[s_9]), u32((i32(0))), u32((i32(3)))));
    var bits_1 : u32 = (extractBits((group_stream_0[s_9]), u32((i32(3))), u32((i32(6)))));
    var value_2 : u32 = load_bits_0(p_3 + c_1 * bits_1, bits_1);
    var value_3 : u32;
    if(index_0 > u32(0))
    {
        var _S62 : u32 = u32(6) * c_1;
        var at_2 : u32 = p_3 + n_6 * (bits_1 + u32(3)) + (index_0 - u32(1)) * width_sum_0(widths_3) + width_sum_0((widths_3 & ((((u32(1) << (_S62))) - u32(1)))));
        var _S63 : u32 = (extractBits((widths_3), u32((i32(_S62))), u32((i32(6)))));
        value_3 = value_2 + unzigzag_0(load_bits_0(at_2, _S63));
    }
    else
    {
        value_3 = value_2;
    }
    var _S64 : u32 = bits_mask_0(s_9);
    return (value_3 & (_S64));
}

fn is_packed_0( s_10 : u32) -> bool
{
    var _S65 : u32 = (extractBits((group_places_0[s_10]), u32((i32(16))), u32((i32(6)))));
    return _S65 <= u32(2);
}

fn put_field_0( at_3 : u32,  value_4 : u32) -> vec2<u32>
{
    var _S66 : vec2<u32>;
    if(at_3 < u32(32))
    {
        _S66 = vec2<u32>((value_4 << (at_3)), (((value_4 >> (u32(1)))) >> ((u32(31) - at_3))));
    }
    else
    {
        _S66 = vec2<u32>(u32(0), (value_4 << ((at_3 - u32(32)))));
    }
    return _S66;
}

fn word_of_0( s_11 : u32,  id_0 : u32) -> u32
{
    var _S67 : u32 = (extractBits((group_places_0[s_11]), u32((i32(0))), u32((i32(16)))));
    var _S68 : u32 = (extractBits((group_places_0[s_11]), u32((i32(16))), u32((i32(6)))));
    return _S67 + _S68 * ((id_0 & (u32(63))));
}

fn vertex_at_0( s_12 : u32,  id_1 : u32) -> vec2<u32>
{
    var word_1 : u32 = word_of_0(s_12, id_1);
    var _S69 : u32 = (extractBits((group_places_0[s_12]), u32((i32(16))), u32((i32(6)))));
    if(_S69 == u32(1))
    {
        return vec2<u32>(all_values_0[the_values_0 + word_1], u32(0));
    }
    var _S70 : u32 = u32(2) * ((word_1 >> (u32(1))));
    return vec2<u32>(all_values_0[the_values_0 + _S70], all_values_0[the_values_0 + _S70 + u32(1)]);
}

fn put_vertex_0( s_13 : u32,  id_2 : u32,  fields_0 : vec2<u32>)
{
    var word_2 : u32 = word_of_0(s_13, id_2);
    var _S71 : u32 = (extractBits((group_places_0[s_13]), u32((i32(16))), u32((i32(6)))));
    if(_S71 == u32(1))
    {
        all_values_0[the_values_0 + word_2] = fields_0.x;
    }
    else
    {
        var _S72 : u32 = u32(2) * ((word_2 >> (u32(1))));
        all_values_0[the_values_0 + _S72] = fields_0.x;
        all_values_0[the_values_0 + _S72 + u32(1)] = fields_0.y;
    }
    return;
}

fn put_value_0( s_14 : u32,  c_2 : u32,  id_3 : u32,  value_5 : u32)
{
    var _S73 : u32 = bits_mask_0(s_14);
    var inside_0 : u32 = (value_5 & (_S73));
    var _S74 : bool = is_packed_0(s_14);
    if(!_S74)
    {
        var _S75 : u32 = the_values_0;
        var _S76 : u32 = word_of_0(s_14, id_3);
        all_values_0[_S75 + (_S76 + c_2)] = inside_0;
        return;
    }
    var before_4 : vec2<u32>;
    if(c_2 == u32(0))
    {
        before_4 = vec2<u32>(u32(0));
    }
    else
    {
        var _S77 : vec2<u32> = vertex_at_0(s_14, id_3);
        before_4 = _S77;
    }
    var _S78 : u32 = (extractBits((group_places_0[s_14]), u32((i32(22))), u32((i32(6)))));
    put_vertex_0(s_14, id_3, (before_4 | ((put_field_0(c_2 * _S78, inside_0)))));
    return;
}

fn after_anchors_0( p_4 : u32,  s_15 : u32,  count_2 : u32,  widths_4 : u32) -> u32
{
    var n_7 : u32 = (extractBits((group_stream_0[s_15]), u32((i32(0))), u32((i32(3)))));
    var _S79 : u32;
    if(count_2 > u32(0))
    {
        var _S80 : u32 = (extractBits((group_stream_0[s_15]), u32((i32(3))), u32((i32(6)))));
        _S79 = p_4 + n_7 * _S80;
    }
    else
    {
        _S79 = p_4;
    }
    if(count_2 > u32(1))
    {
        _S79 = _S79 + (u32(3) * n_7 + (count_2 - u32(1)) * width_sum_0(widths_4));
    }
    return _S79;
}

fn read_anchors_0( h_7 : Header_0,  index_1 : u32,  begin_1 : u32,  end_1 : u32,  id_4 : u32)
{
    var _S81 : Places_0 = places_of_0(h_7.meshlet_0);
    var count_3 : u32 = mask_count_0(the_starts_0);
    var p_5 : u32 = _S81.anchors_0;
    var s_16 : u32 = u32(0);
    for(;;)
    {
        if(s_16 < end_1)
        {
        }
        else
        {
            break;
        }
        var count_4 : u32 = anchors_of_0(h_7, s_16, count_3);
        var widths_5 : u32 = further_widths_0(p_5, s_16, count_4);
        if(s_16 >= begin_1)
        {
            var _S82 : u32 = (extractBits((group_stream_0[s_16]), u32((i32(0))), u32((i32(3)))));
            var _S83 : vec2<u32> = vec2<u32>(u32(0));
            var c_3 : u32 = u32(0);
            var fields_1 : vec2<u32> = _S83;
            for(;;)
            {
                if(c_3 < _S82)
                {
                }
                else
                {
                    break;
                }
                var value_6 : u32 = anchor_value_0(s_16, p_5, index_1, widths_5, c_3);
                var _S84 : bool = is_packed_0(s_16);
                if(_S84)
                {
                    var _S85 : u32 = (extractBits((group_places_0[s_16]), u32((i32(22))), u32((i32(6)))));
                    fields_1 = (fields_1 | ((put_field_0(c_3 * _S85, value_6))));
                }
                else
                {
                    put_value_0(s_16, c_3, id_4, value_6);
                }
                c_3 = c_3 + u32(1);
            }
            var _S86 : bool = is_packed_0(s_16);
            if(_S86)
            {
                put_vertex_0(s_16, id_4, fields_1);
            }
        }
        var _S87 : u32 = after_anchors_0(p_5, s_16, count_4, widths_5);
        var _S88 : u32 = s_16 + u32(1);
        count_3 = count_4;
        p_5 = _S87;
        s_16 = _S88;
    }
    return;
}

fn entry_position_0( h_8 : Header_0,  r_2 : u32) -> u32
{
    return h_8.entries_1 + h_8.entry_width_0 * mask_count_0(((h_8.foreign_refs_1) & ((mask_below_0(r_2)))));
}

fn entry_owner_0( h_9 : Header_0,  entry_0 : u32) -> u32
{
    var delta_0 : u32 = load_bits_0(entry_0, h_9.delta_width_0);
    var _S89 : bool = delta_0 > (h_9.meshlet_0);
    if(_S89)
    {
        error_0 = u32(5);
    }
    var _S90 : u32;
    if(_S89)
    {
        _S90 = u32(0);
    }
    else
    {
        _S90 = h_9.meshlet_0 - delta_0;
    }
    return _S90;
}

fn owner_of_0( h_10 : Header_0,  r_3 : u32) -> u32
{
    var _S91 : u32 = entry_owner_0(h_10, entry_position_0(h_10, r_3));
    return _S91;
}

fn entry_slot_0( h_11 : Header_0,  entry_1 : u32) -> u32
{
    return load_bits_0(entry_1 + h_11.delta_width_0, h_11.slot_width_0);
}

fn slot_reference_0( h_12 : Header_0,  slot_0 : u32) -> u32
{
    var rest_2 : vec2<u32> = h_12.owned_refs_0;
    var i_6 : u32 = u32(0);
    for(;;)
    {
        var _S92 : bool;
        if(i_6 < slot_0)
        {
            _S92 = mask_any_0(rest_2);
        }
        else
        {
            _S92 = false;
        }
        if(_S92)
        {
        }
        else
        {
            break;
        }
        var _S93 : vec2<u32> = mask_clear_lsb_0(rest_2);
        var _S94 : u32 = i_6 + u32(1);
        rest_2 = _S93;
        i_6 = _S94;
    }
    if(!mask_any_0(rest_2))
    {
        error_0 = u32(5);
    }
    return mask_lsb_0(rest_2);
}

fn next_reference_0( h_13 : Header_0,  r_4 : u32) -> u32
{
    var _S95 : u32;
    if(mask_test_0(h_13.loop_ends_2, r_4))
    {
        _S95 = loop_begin_0(h_13, r_4);
    }
    else
    {
        _S95 = r_4 + u32(1);
    }
    return _S95;
}

fn read_corner_0( own_1 : Header_0,  j_0 : u32,  s_17 : u32,  id_5 : u32) -> u32
{
    var apart_0 : bool = false;
    var h_14 : Header_0 = own_1;
    var _S96 : u32 = j_0;
    var hop_0 : u32 = u32(0);
    for(;;)
    {
        var _S97 : bool;
        if(hop_0 <= group_hops_0)
        {
            _S97 = error_0 == u32(0);
        }
        else
        {
            _S97 = false;
        }
        if(_S97)
        {
        }
        else
        {
            break;
        }
        if(apart_0)
        {
            apart_0 = true;
        }
        else
        {
            apart_0 = (((h_14.flags_0) & (u32(4)))) != u32(0);
        }
        var seams_3 : vec2<u32> = seam_references_0(h_14, s_17);
        var shared_refs_0 : vec2<u32> = ((h_14.foreign_refs_1) & ((~seams_3)));
        var _S98 : Header_0 = h_14;
        var before_5 : u32;
        if((h_14.references_1) > u32(0))
        {
            before_5 = ((previous_reference_0(h_14, _S96)) & (u32(63)));
        }
        else
        {
            before_5 = u32(0);
        }
        var follow_0 : bool = mask_test_0(shared_refs_0, _S96);
        var follow_before_0 : bool = mask_test_0(shared_refs_0, before_5);
        var _S99 : bool;
        if(!follow_0)
        {
            _S99 = !follow_before_0;
        }
        else
        {
            _S99 = false;
        }
        var end_2 : u32;
        if(_S99)
        {
            if(apart_0)
            {
                end_2 = s_17 + u32(1);
            }
            else
            {
                end_2 = _S4.y + u32(1);
            }
            if((_S98.references_1) == u32(0))
            {
            }
            else
            {
                _S96 = mask_count_0(((stored_corners_0(h_14, seams_3)) & ((mask_below_0(_S96)))));
            }
            read_anchors_0(h_14, _S96, s_17, end_2, id_5);
            return end_2;
        }
        var _S100 : bool;
        if(follow_0)
        {
            _S100 = follow_before_0;
        }
        else
        {
            _S100 = false;
        }
        var follow_1 : bool;
        if(_S100)
        {
            var _S101 : u32 = owner_of_0(h_14, before_5);
            var _S102 : u32 = owner_of_0(h_14, _S96);
            follow_1 = _S101 >= _S102;
        }
        else
        {
            follow_1 = follow_0;
        }
        if(follow_1)
        {
            end_2 = _S96;
        }
        else
        {
            end_2 = before_5;
        }
        var entry_2 : u32 = entry_position_0(h_14, end_2);
        var slot_1 : u32 = entry_slot_0(h_14, entry_2);
        var _S103 : u32 = entry_owner_0(h_14, entry_2);
        var h_15 : Header_0 = header_of_0(_S103);
        var _S104 : u32 = slot_reference_0(h_15, slot_1);
        var reference_0 : u32 = (_S104 & (u32(63)));
        if(follow_1)
        {
            _S96 = ((next_reference_0(h_15, reference_0)) & (u32(63)));
        }
        else
        {
            _S96 = reference_0;
        }
        var _S105 : u32 = hop_0 + u32(1);
        h_14 = h_15;
        hop_0 = _S105;
    }
    if(error_0 == u32(0))
    {
        error_0 = u32(6);
    }
    return stream_end_0;
}

fn close_pass_0()
{
    if(error_0 != u32(0))
    {
        var _S106 : u32 = atomicOr(&(the_summaries_0[job_place_0]), (error_0 << (u32(16))));
    }
    return;
}

@compute
@workgroup_size(64, 1, 1)
fn main(@builtin(local_invocation_index) gl_LocalInvocationIndex_0 : u32, @builtin(workgroup_id) gl_WorkGroupID_0 : vec3<u32>)
{
    _S3 = gl_LocalInvocationIndex_0;
    _S4 = gl_WorkGroupID_0;
    if(gl_LocalInvocationIndex_0 == u32(0))
    {
        group_hops_0 = u32(8);
    }
    var _S107 : bool = open_pass_0();
    if(!_S107)
    {
        return;
    }
    var h_16 : Header_0 = open_header_0();
    var _S108 : bool = (h_16.references_1) == u32(0);
    var _S109 : u32;
    if(_S108)
    {
        _S109 = mask_count_0(the_starts_0);
    }
    else
    {
        _S109 = h_16.references_1;
    }
    var j_1 : u32 = part_0;
    for(;;)
    {
        if(j_1 < _S109)
        {
        }
        else
        {
            break;
        }
        var _S110 : u32;
        if(_S108)
        {
            _S110 = ((ids_before_0(j_1)) & (u32(63)));
        }
        else
        {
            _S110 = id_at_0(nth_bit_0(the_references_0, j_1));
        }
        var s_18 : u32 = _S4.y;
        for(;;)
        {
            var _S111 : bool;
            if(s_18 < (_S4.y + u32(1)))
            {
                _S111 = error_0 == u32(0);
            }
            else
            {
                _S111 = false;
            }
            if(_S111)
            {
            }
            else
            {
                break;
            }
            var _S112 : u32 = read_corner_0(h_16, j_1, s_18, _S110);
            s_18 = _S112;
        }
        j_1 = j_1 + u32(8);
    }
    close_pass_0();
    return;
}

