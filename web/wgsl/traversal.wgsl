// Translated from shaders/decoders/traversal.comp by web/build_wgsl.py: do not edit.
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
    member_0 = _S3;
    part_0 = _S3 % u32(1);
    var number_0 : u32 = push_0.first_0 + _S4.x * u32(64) + _S3;
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
    if(member_0 < u32(64))
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

fn mask_shl1_0( m_0 : vec2<u32>) -> vec2<u32>
{
    var _S20 : u32 = m_0.x;
    return vec2<u32>((_S20 << (u32(1))), ((((m_0.y) << (u32(1)))) | (((_S20 >> (u32(31)))))));
}

fn mask_bit_0( i_3 : u32) -> vec2<u32>
{
    var _S21 : vec2<u32>;
    if(((i_3 & (u32(32)))) == u32(0))
    {
        _S21 = vec2<u32>((u32(1) << (((i_3 & (u32(31)))))), u32(0));
    }
    else
    {
        _S21 = vec2<u32>(u32(0), (u32(1) << (((i_3 & (u32(31)))))));
    }
    return _S21;
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
    var _S22 : u32 = (extractBits((places_0.counts_0), u32((i32(0))), u32((i32(7)))));
    h_0.triangles_0 = _S22;
    var _S23 : u32 = (extractBits((places_0.counts_0), u32((i32(7))), u32((i32(6)))));
    h_0.references_1 = _S23;
    var _S24 : u32 = (extractBits((places_0.counts_0), u32((i32(13))), u32((i32(3)))));
    h_0.flags_0 = _S24;
    var _S25 : u32 = (extractBits((places_0.counts_0), u32((i32(16))), u32((i32(3)))));
    h_0.length_width_0 = _S25;
    var _S26 : u32 = (extractBits((places_0.counts_0), u32((i32(19))), u32((i32(5)))));
    h_0.delta_width_0 = _S26;
    var _S27 : u32 = (extractBits((places_0.counts_0), u32((i32(24))), u32((i32(3)))));
    h_0.slot_width_0 = _S27;
    var _S28 : u32 = _S26 + _S27;
    var _S29 : u32;
    if(((_S24 & (u32(4)))) != u32(0))
    {
        _S29 = stream_total_0 - u32(1);
    }
    else
    {
        _S29 = u32(0);
    }
    h_0.entry_width_0 = _S28 + _S29;
    h_0.lengths_1 = places_0.lengths_0;
    h_0.entries_1 = places_0.entries_0;
    h_0.codes_1 = places_0.codes_0;
    h_0.foreign_refs_1 = places_0.foreign_refs_0;
    h_0.private_refs_1 = places_0.private_refs_0;
    h_0.loop_ends_2 = places_0.loop_ends_0;
    var _S30 : vec2<u32> = ((mask_below_0(h_0.references_1)) & ((~(((places_0.foreign_refs_0) | ((places_0.private_refs_0)))))));
    h_0.owned_refs_0 = _S30;
    h_0.sized_refs_0 = (_S30 | ((((places_0.private_refs_0) & ((~lone_references_0(places_0.loop_ends_0)))))));
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

fn mask_any_0( m_3 : vec2<u32>) -> bool
{
    return (((m_3.x) | ((m_3.y)))) != u32(0);
}

fn load_words2_0( i_4 : u32) -> vec2<u32>
{
    return vec2<u32>(load_memory_0(i_4), load_memory_0(i_4 + u32(1)));
}

fn funnel_0( low_0 : u32,  high_0 : u32,  shift_0 : u32) -> u32
{
    return (((low_0 >> (shift_0))) | (((((high_0 << (u32(1)))) << ((u32(31) - shift_0))))));
}

fn load_bits_0( p_0 : u32,  n_2 : u32) -> u32
{
    var words_2 : vec2<u32> = load_words2_0((p_0 >> (u32(5))));
    return ((funnel_0(words_2.x, words_2.y, (p_0 & (u32(31))))) & ((word_below_0(n_2))));
}

fn code_at_0( p_1 : ptr<function, u32>,  s_4 : u32,  of_chains_0 : bool) -> u32
{
    var field_2 : u32 = load_bits_0((*p_1), u32(3));
    (*p_1) = (*p_1) + u32(3);
    if(field_2 == u32(7))
    {
        var _S31 : u32 = (extractBits((group_stream_0[s_4]), u32((i32(0))), u32((i32(3)))));
        (*p_1) = (*p_1) + u32(5) * _S31;
        return u32(255);
    }
    var base_1 : u32;
    if(of_chains_0)
    {
        var _S32 : u32 = (extractBits((group_bases_0[s_4]), u32((i32(0))), u32((i32(5)))));
        base_1 = _S32;
    }
    else
    {
        var _S33 : u32 = (extractBits((group_bases_0[s_4]), u32((i32(8))), u32((i32(5)))));
        base_1 = _S33;
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
    var k_0 : u32;
    if(rice_0)
    {
        k_0 = base_1 + field_2;
    }
    else
    {
        k_0 = max(base_1, u32(1)) - u32(1) + field_2 - u32(4);
    }
    if(k_0 > u32(31))
    {
        error_0 = u32(7);
    }
    var _S34 : u32 = (k_0 & (u32(31)));
    if(rice_0)
    {
        base_1 = u32(0);
    }
    else
    {
        base_1 = u32(32);
    }
    return (_S34 | (base_1));
}

fn mask_none_0() -> vec2<u32>
{
    return vec2<u32>(u32(0));
}

fn mask_lsb_0( m_4 : vec2<u32>) -> u32
{
    var _S35 : u32 = m_4.x;
    var _S36 : u32;
    if(_S35 != u32(0))
    {
        _S36 = firstbitlow_0(_S35);
    }
    else
    {
        var _S37 : u32 = m_4.y;
        if(_S37 != u32(0))
        {
            _S36 = u32(32) + firstbitlow_0(_S37);
        }
        else
        {
            _S36 = u32(64);
        }
    }
    return _S36;
}

fn mask_clear_lsb_0( m_5 : vec2<u32>) -> vec2<u32>
{
    var _S38 : u32 = m_5.x;
    var _S39 : vec2<u32>;
    if(_S38 != u32(0))
    {
        _S39 = vec2<u32>((_S38 & ((_S38 - u32(1)))), m_5.y);
    }
    else
    {
        var _S40 : u32 = m_5.y;
        _S39 = vec2<u32>(u32(0), (_S40 & ((_S40 - u32(1)))));
    }
    return _S39;
}

fn seam_references_0( h_2 : Header_0,  s_5 : u32) -> vec2<u32>
{
    var seams_0 : vec2<u32> = mask_none_0();
    var _S41 : bool;
    if(s_5 == u32(0))
    {
        _S41 = true;
    }
    else
    {
        _S41 = (((h_2.flags_0) & (u32(4)))) == u32(0);
    }
    if(_S41)
    {
        return seams_0;
    }
    var _S42 : u32 = h_2.entries_1 + h_2.delta_width_0 + h_2.slot_width_0 + s_5 - u32(1);
    var rest_0 : vec2<u32> = h_2.foreign_refs_1;
    var seams_1 : vec2<u32> = seams_0;
    var share_0 : u32 = _S42;
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

fn nth_bit_0( m_6 : vec2<u32>,  n_3 : u32) -> u32
{
    var _S43 : u32 = m_6.x;
    var low_1 : u32 = countOneBits(_S43);
    var _S44 : bool = n_3 < low_1;
    var half_width_0 : u32;
    if(_S44)
    {
        half_width_0 = u32(0);
    }
    else
    {
        half_width_0 = u32(32);
    }
    var word_0 : u32;
    if(_S44)
    {
        word_0 = _S43;
    }
    else
    {
        word_0 = m_6.y;
    }
    var _S45 : u32;
    if(n_3 >= low_1)
    {
        _S45 = n_3 - low_1;
    }
    else
    {
        _S45 = n_3;
    }
    var _S46 : u32 = half_width_0;
    half_width_0 = u32(16);
    var at_0 : u32 = _S46;
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
        if(_S45 >= ones_0)
        {
            var _S47 : u32 = _S45 - ones_0;
            var at_1 : u32 = at_0 + half_width_0;
            word_0 = (word_0 >> (half_width_0));
            _S45 = _S47;
            at_0 = at_1;
        }
        half_width_0 = (half_width_0 >> (u32(1)));
    }
    return min(at_0, u32(63));
}

struct Run_0
{
     rank_0 : u32,
     steps_0 : u32,
};

fn Run_x24init_0( rank_1 : u32,  steps_1 : u32) -> Run_0
{
    var _S48 : Run_0;
    _S48.rank_0 = rank_1;
    _S48.steps_0 = steps_1;
    return _S48;
}

fn run_of_0( r_0 : u32) -> Run_0
{
    var rank_2 : u32 = nth_bit_0(the_references_0, r_0);
    var later_0 : vec2<u32> = (the_references_0 & ((~mask_below_0(rank_2 + u32(1)))));
    var end_1 : u32;
    if(mask_any_0(later_0))
    {
        end_1 = mask_lsb_0(later_0);
    }
    else
    {
        end_1 = mask_count_0(the_boundary_0);
    }
    return Run_x24init_0(rank_2, min(end_1 - rank_2, u32(64)));
}

fn seam_vertices_0( h_3 : Header_0,  s_6 : u32) -> u32
{
    var rest_1 : vec2<u32> = seam_references_0(h_3, s_6);
    var count_0 : u32 = u32(0);
    for(;;)
    {
        if(mask_any_0(rest_1))
        {
        }
        else
        {
            break;
        }
        var count_1 : u32 = count_0 + (run_of_0(mask_lsb_0(rest_1)).steps_0 - u32(1));
        rest_1 = mask_clear_lsb_0(rest_1);
        count_0 = count_1;
    }
    return min(count_0, u32(64));
}

fn after_ones_0( p_2 : u32,  n_4 : u32) -> u32
{
    if(n_4 == u32(0))
    {
        return p_2;
    }
    var w_0 : u32 = (p_2 >> (u32(5)));
    var word_1 : u32 = ((load_word_0(w_0)) & ((~word_below_0((p_2 & (u32(31)))))));
    var ones_1 : u32 = countOneBits(word_1);
    var empty_0 : u32 = u32(0);
    var _S49 : u32 = n_4;
    var w_1 : u32 = w_0;
    var word_2 : u32 = word_1;
    for(;;)
    {
        if(ones_1 < _S49)
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
        var _S50 : bool;
        if(w_1 >= (push_0.blob_words_0))
        {
            _S50 = true;
        }
        else
        {
            _S50 = empty_0 > u32(512);
        }
        if(_S50)
        {
            error_0 = u32(8);
            return p_2;
        }
        var _S51 : u32 = _S49 - ones_1;
        var w_2 : u32 = w_1 + u32(1);
        var word_3 : u32 = load_word_0(w_2);
        ones_1 = countOneBits(word_3);
        _S49 = _S51;
        w_1 = w_2;
        word_2 = word_3;
    }
    ones_1 = _S49;
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
    return ((w_1 << (u32(5)))) + firstbitlow_0(word_2) + u32(1);
}

var<private> residual_code_0 : u32;

fn width_field_0( position_0 : u32) -> u32
{
    var w_3 : u32 = load_bits_0(position_0, u32(5));
    var _S52 : u32;
    if(w_3 == u32(31))
    {
        _S52 = u32(32);
    }
    else
    {
        _S52 = w_3;
    }
    return _S52;
}

fn put_field_0( at_2 : u32,  value_2 : u32) -> vec2<u32>
{
    var _S53 : vec2<u32>;
    if(at_2 < u32(32))
    {
        _S53 = vec2<u32>((value_2 << (at_2)), (((value_2 >> (u32(1)))) >> ((u32(31) - at_2))));
    }
    else
    {
        _S53 = vec2<u32>(u32(0), (value_2 << ((at_2 - u32(32)))));
    }
    return _S53;
}

fn fixed_widths_0( position_1 : u32,  n_5 : u32) -> vec2<u32>
{
    var _S54 : vec2<u32> = vec2<u32>(u32(0));
    var c_0 : u32 = u32(0);
    var widths_0 : vec2<u32> = _S54;
    for(;;)
    {
        if(c_0 < n_5)
        {
        }
        else
        {
            break;
        }
        var widths_1 : vec2<u32> = (widths_0 | ((put_field_0(u32(6) * c_0, width_field_0(position_1 + u32(5) * c_0)))));
        c_0 = c_0 + u32(1);
        widths_0 = widths_1;
    }
    return widths_0;
}

var<private> residual_widths_0 : vec2<u32>;

fn fixed_width_0( elements_0 : u32,  widths_2 : u32) -> u32
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
        var sum_1 : u32 = sum_0 + width_field_0(widths_2 + u32(5) * c_1);
        c_1 = c_1 + u32(1);
        sum_0 = sum_1;
    }
    return sum_0;
}

fn is_exponential_0( code_0 : u32) -> bool
{
    return ((code_0 & (u32(4294967264)))) == u32(32);
}

fn low_size_0( code_1 : u32,  elements_1 : u32,  widths_3 : u32,  n_6 : u32,  zeros_0 : u32) -> u32
{
    if(code_1 == u32(255))
    {
        var _S55 : u32 = n_6 / elements_1;
        return _S55 * fixed_width_0(elements_1, widths_3);
    }
    var _S56 : u32 = n_6 * ((code_1 & (u32(31))));
    var _S57 : u32;
    if(is_exponential_0(code_1))
    {
        _S57 = zeros_0;
    }
    else
    {
        _S57 = u32(0);
    }
    return _S56 + _S57;
}

var<private> low_position_0 : u32;

var<private> low_index_0 : u32;

var<private> low_words_0 : vec2<u32>;

fn seek_low_0( p_3 : u32)
{
    low_position_0 = p_3;
    var _S58 : u32 = (p_3 >> (u32(5)));
    low_index_0 = _S58;
    low_words_0 = load_words2_0(_S58);
    return;
}

struct UnaryReader_0
{
     window_0 : u32,
     base_2 : u32,
     cursor_0 : u32,
};

fn UnaryReader_x24init_0( window_1 : u32,  base_3 : u32,  cursor_1 : u32) -> UnaryReader_0
{
    var _S59 : UnaryReader_0;
    _S59.window_0 = window_1;
    _S59.base_2 = base_3;
    _S59.cursor_0 = cursor_1;
    return _S59;
}

fn seek_unary_0( p_4 : u32) -> UnaryReader_0
{
    return UnaryReader_x24init_0(((load_word_0((p_4 >> (u32(5))))) & ((~word_below_0((p_4 & (u32(31))))))), (p_4 & (u32(4294967264))), p_4);
}

var<private> unary_0 : UnaryReader_0;

fn seek_residuals_0( h_4 : Header_0,  interior_1 : u32,  stream_1 : u32,  traversed_0 : u32)
{
    var codes_2 : u32 = h_4.codes_1;
    var _S60 : bool = mask_any_0(h_4.owned_refs_0);
    var _S61 : u32;
    if(stream_1 == u32(0))
    {
        _S61 = u32(1);
    }
    else
    {
        _S61 = stream_total_0;
    }
    var begin_1 : u32 = interior_1;
    var s_7 : u32 = u32(0);
    var p_5 : u32 = interior_1;
    var low_2 : u32 = u32(0);
    for(;;)
    {
        if(s_7 < _S61)
        {
        }
        else
        {
            break;
        }
        var n_7 : u32 = (extractBits((group_stream_0[s_7]), u32((i32(0))), u32((i32(3)))));
        if(_S60)
        {
            var _S62 : u32 = code_at_0(&(codes_2), s_7, true);
        }
        var code_2 : u32 = code_at_0(&(codes_2), s_7, false);
        var widths_4 : u32 = codes_2 - u32(5) * n_7;
        var _S63 : u32 = min(traversed_0 + seam_vertices_0(h_4, s_7), u32(64));
        var _S64 : bool = code_2 == u32(255);
        var ones_2 : u32;
        if(_S64)
        {
            ones_2 = u32(0);
        }
        else
        {
            ones_2 = _S63 * n_7;
        }
        var next_0 : u32 = after_ones_0(p_5, ones_2);
        if(s_7 == stream_1)
        {
            residual_code_0 = code_2;
            var _S65 : vec2<u32>;
            if(_S64)
            {
                _S65 = fixed_widths_0(widths_4, n_7);
            }
            else
            {
                _S65 = vec2<u32>(u32(0));
            }
            residual_widths_0 = _S65;
            begin_1 = p_5;
        }
        var size_0 : u32 = low_size_0(code_2, n_7, widths_4, _S63 * n_7, next_0 - p_5 - ones_2);
        var low_3 : u32;
        if(s_7 < stream_1)
        {
            low_3 = low_2 + size_0;
        }
        else
        {
            low_3 = low_2;
        }
        var _S66 : bool;
        if(s_7 == u32(0))
        {
            _S66 = stream_1 != u32(0);
        }
        else
        {
            _S66 = false;
        }
        if(_S66)
        {
            p_5 = next_0 + low_3;
            low_2 = u32(0);
        }
        else
        {
            p_5 = next_0;
            low_2 = low_3;
        }
        s_7 = s_7 + u32(1);
    }
    seek_low_0(p_5 + low_2);
    unary_0 = seek_unary_0(begin_1);
    return;
}

fn id_at_0( rank_3 : u32) -> u32
{
    return nth_bit_0(the_boundary_0, rank_3);
}

fn inner_ids_0( run_0 : Run_0) -> vec2<u32>
{
    return (((the_boundary_0 & ((~mask_below_0(id_at_0(run_0.rank_0) + u32(1)))))) & ((mask_below_0(id_at_0(run_0.rank_0 + run_0.steps_0 - u32(1)) + u32(1)))));
}

fn mask_test_0( m_7 : vec2<u32>,  i_5 : u32) -> bool
{
    var _S67 : u32;
    if(((i_5 & (u32(32)))) == u32(0))
    {
        _S67 = m_7.x;
    }
    else
    {
        _S67 = m_7.y;
    }
    return ((((_S67 >> (((i_5 & (u32(31))))))) & (u32(1)))) != u32(0);
}

fn pushed_vertices_0( some_0 : vec2<u32>) -> u32
{
    return mask_count_0((some_0 & ((~((symbol_c_0 | (symbol_s_0))))))) + mask_count_0((some_0 & (symbol_e_0)));
}

fn ids_before_0( k_1 : u32) -> u32
{
    var t_0 : u32;
    if(k_1 >= (mask_count_0(the_starts_0)))
    {
        t_0 = triangle_count_0;
    }
    else
    {
        t_0 = nth_bit_0(the_starts_0, k_1);
    }
    return min(u32(64), pushed_vertices_0(mask_below_0(t_0)) + min(k_1, mask_count_0(the_starts_0)));
}

fn loop_of_0( h_5 : Header_0,  r_1 : u32) -> vec2<u32>
{
    var k_2 : u32 = mask_count_0(((h_5.loop_ends_2) & ((mask_below_0(r_1)))));
    return vec2<u32>(mask_count_0((the_boundary_0 & ((mask_below_0(ids_before_0(k_2)))))), mask_count_0((the_boundary_0 & ((mask_below_0(ids_before_0(k_2 + u32(1))))))));
}

fn last_id_0( h_6 : Header_0,  r_2 : u32,  run_1 : Run_0) -> u32
{
    var _S68 : u32;
    if(mask_test_0(h_6.loop_ends_2, r_2))
    {
        _S68 = loop_of_0(h_6, r_2).x;
    }
    else
    {
        _S68 = run_1.rank_0 + run_1.steps_0;
    }
    return id_at_0(_S68);
}

struct Chain_0
{
     steps_2 : u32,
     from_0 : u32,
     to_0 : u32,
     inner_0 : vec2<u32>,
     backwards_0 : bool,
};

fn Chain_x24init_0( steps_3 : u32,  from_1 : u32,  to_1 : u32,  inner_1 : vec2<u32>,  backwards_1 : bool) -> Chain_0
{
    var _S69 : Chain_0;
    _S69.steps_2 = steps_3;
    _S69.from_0 = from_1;
    _S69.to_0 = to_1;
    _S69.inner_0 = inner_1;
    _S69.backwards_0 = backwards_1;
    return _S69;
}

fn is_packed_0( s_8 : u32) -> bool
{
    var _S70 : u32 = (extractBits((group_places_0[s_8]), u32((i32(16))), u32((i32(6)))));
    return _S70 <= u32(2);
}

fn bits_mask_0( s_9 : u32) -> u32
{
    var _S71 : u32 = (extractBits((group_stream_0[s_9]), u32((i32(3))), u32((i32(6)))));
    return word_below_0(_S71);
}

fn word_of_0( s_10 : u32,  id_0 : u32) -> u32
{
    var _S72 : u32 = (extractBits((group_places_0[s_10]), u32((i32(0))), u32((i32(16)))));
    var _S73 : u32 = (extractBits((group_places_0[s_10]), u32((i32(16))), u32((i32(6)))));
    return _S72 + _S73 * ((id_0 & (u32(63))));
}

fn vertex_at_0( s_11 : u32,  id_1 : u32) -> vec2<u32>
{
    var word_5 : u32 = word_of_0(s_11, id_1);
    var _S74 : u32 = (extractBits((group_places_0[s_11]), u32((i32(16))), u32((i32(6)))));
    if(_S74 == u32(1))
    {
        return vec2<u32>(all_values_0[the_values_0 + word_5], u32(0));
    }
    var _S75 : u32 = u32(2) * ((word_5 >> (u32(1))));
    return vec2<u32>(all_values_0[the_values_0 + _S75], all_values_0[the_values_0 + _S75 + u32(1)]);
}

fn mask_msb_0( m_8 : vec2<u32>) -> u32
{
    var _S76 : u32 = m_8.y;
    var _S77 : u32;
    if(_S76 != u32(0))
    {
        _S77 = u32(32) + firstbithigh_0(_S76);
    }
    else
    {
        var _S78 : u32 = m_8.x;
        if(_S78 != u32(0))
        {
            _S77 = firstbithigh_0(_S78);
        }
        else
        {
            _S77 = u32(64);
        }
    }
    return _S77;
}

fn get_field_0( fields_0 : vec2<u32>,  at_3 : u32,  bits_1 : u32) -> u32
{
    var value_3 : u32;
    if(at_3 < u32(32))
    {
        value_3 = ((((fields_0.x) >> (at_3))) | ((((((fields_0.y) << (u32(1)))) << ((u32(31) - at_3))))));
    }
    else
    {
        value_3 = ((fields_0.y) >> ((at_3 - u32(32))));
    }
    return (value_3 & ((word_below_0(bits_1))));
}

fn value_at_0( s_12 : u32,  c_2 : u32,  id_2 : u32) -> u32
{
    var _S79 : bool = is_packed_0(s_12);
    if(_S79)
    {
        var _S80 : vec2<u32> = vertex_at_0(s_12, id_2);
        var _S81 : u32 = (extractBits((group_places_0[s_12]), u32((i32(22))), u32((i32(6)))));
        var _S82 : u32 = c_2 * _S81;
        var _S83 : u32 = (extractBits((group_places_0[s_12]), u32((i32(22))), u32((i32(6)))));
        return get_field_0(_S80, _S82, _S83);
    }
    var _S84 : u32 = the_values_0;
    var _S85 : u32 = word_of_0(s_12, id_2);
    return all_values_0[_S84 + (_S85 + c_2)];
}

fn shift_right_0( x_0 : u32,  n_8 : u32) -> u32
{
    return u32((i32(x_0) >> (n_8)));
}

struct Weights_0
{
     exist_0 : bool,
     s_13 : u32,
     u_0 : u32,
};

fn affine_point_0( w_4 : Weights_0,  a_0 : u32,  b_0 : u32,  o_0 : u32) -> u32
{
    return a_0 + shift_right_0(w_4.s_13 * (b_0 - a_0) + w_4.u_0 * (o_0 - a_0) + u32(128), u32(8));
}

fn divide_0( x_1 : u32,  n_9 : u32) -> u32
{
    var _S86 : u32 = x_1 / n_9;
    return _S86;
}

fn toward_0( a_1 : u32,  b_1 : u32,  n_10 : u32) -> u32
{
    var _S87 : u32 = divide_0(b_1 - a_1 + ((n_10 >> (u32(1)))) + ((n_10 << (u32(24)))), n_10);
    return a_1 + _S87 - u32(16777216);
}

fn affine_chain_point_0( w_5 : Weights_0,  before_2 : u32,  end_2 : u32,  earlier_0 : u32,  left_0 : u32) -> u32
{
    var _S88 : u32;
    if(w_5.exist_0)
    {
        _S88 = affine_point_0(w_5, before_2, end_2, earlier_0);
    }
    else
    {
        var _S89 : u32 = toward_0(before_2, end_2, left_0);
        _S88 = _S89;
    }
    return _S88;
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
        var _S90 : u32 = unary_0.base_2 + u32(32);
        unary_0.base_2 = _S90;
        var _S91 : bool;
        if(((_S90 >> (u32(5)))) >= (push_0.blob_words_0))
        {
            _S91 = true;
        }
        else
        {
            _S91 = (unary_0.base_2 - unary_0.cursor_0) > u32(16415);
        }
        if(_S91)
        {
            error_0 = u32(8);
            return u32(0);
        }
        unary_0.window_0 = load_word_0(((unary_0.base_2) >> (u32(5))));
    }
    var one_0 : u32 = unary_0.base_2 + firstbitlow_0(unary_0.window_0);
    var quotient_0 : u32 = one_0 - unary_0.cursor_0;
    unary_0.window_0 = ((unary_0.window_0) & ((unary_0.window_0 - u32(1))));
    unary_0.cursor_0 = one_0 + u32(1);
    if(quotient_0 > u32(16383))
    {
        error_0 = u32(8);
    }
    return quotient_0;
}

fn exponential_quotient_0( parameter_0 : u32,  q_0 : u32) -> u32
{
    var _S92 : bool;
    if(q_0 <= u32(31))
    {
        _S92 = (parameter_0 + q_0) <= u32(32);
    }
    else
    {
        _S92 = false;
    }
    if(_S92)
    {
        return q_0;
    }
    error_0 = u32(7);
    return u32(0);
}

fn take_low_0( width_0 : u32) -> u32
{
    var w_6 : u32 = (low_position_0 >> (u32(5)));
    if(w_6 != low_index_0)
    {
        var _S93 : u32;
        if(w_6 == (low_index_0 + u32(1)))
        {
            _S93 = low_words_0.y;
        }
        else
        {
            _S93 = load_word_0(w_6);
        }
        low_words_0 = vec2<u32>(_S93, load_word_0(w_6 + u32(1)));
        low_index_0 = w_6;
    }
    var bits_2 : u32 = ((funnel_0(low_words_0.x, low_words_0.y, (low_position_0 & (u32(31))))) & ((word_below_0(width_0))));
    low_position_0 = low_position_0 + width_0;
    return bits_2;
}

fn unzigzag_0( u_1 : u32) -> u32
{
    return (((u_1 >> (u32(1)))) ^ ((u32(0) - ((u_1 & (u32(1)))))));
}

fn next_residual_0( c_3 : u32) -> u32
{
    var fixed_code_0 : bool = residual_code_0 == u32(255);
    var parameter_1 : u32 = (residual_code_0 & (u32(31)));
    var width_1 : u32;
    if(fixed_code_0)
    {
        width_1 = get_field_0(residual_widths_0, u32(6) * c_3, u32(6));
    }
    else
    {
        width_1 = parameter_1;
    }
    var above_0 : u32;
    if(fixed_code_0)
    {
        above_0 = u32(0);
    }
    else
    {
        var _S94 : u32 = next_quotient_0();
        above_0 = _S94;
    }
    if(is_exponential_0(residual_code_0))
    {
        var longer_0 : u32 = exponential_quotient_0(parameter_1, above_0);
        var width_2 : u32 = width_1 + longer_0;
        above_0 = ((u32(1) << (longer_0))) - u32(1);
        width_1 = width_2;
    }
    var _S95 : u32 = take_low_0(width_1);
    return unzigzag_0(_S95 + ((above_0 << (parameter_1))));
}

fn put_vertex_0( s_14 : u32,  id_3 : u32,  fields_1 : vec2<u32>)
{
    var word_6 : u32 = word_of_0(s_14, id_3);
    var _S96 : u32 = (extractBits((group_places_0[s_14]), u32((i32(16))), u32((i32(6)))));
    if(_S96 == u32(1))
    {
        all_values_0[the_values_0 + word_6] = fields_1.x;
    }
    else
    {
        var _S97 : u32 = u32(2) * ((word_6 >> (u32(1))));
        all_values_0[the_values_0 + _S97] = fields_1.x;
        all_values_0[the_values_0 + _S97 + u32(1)] = fields_1.y;
    }
    return;
}

fn put_value_0( s_15 : u32,  c_4 : u32,  id_4 : u32,  value_4 : u32)
{
    var _S98 : u32 = bits_mask_0(s_15);
    var inside_0 : u32 = (value_4 & (_S98));
    var _S99 : bool = is_packed_0(s_15);
    if(!_S99)
    {
        var _S100 : u32 = the_values_0;
        var _S101 : u32 = word_of_0(s_15, id_4);
        all_values_0[_S100 + (_S101 + c_4)] = inside_0;
        return;
    }
    var before_3 : vec2<u32>;
    if(c_4 == u32(0))
    {
        before_3 = vec2<u32>(u32(0));
    }
    else
    {
        var _S102 : vec2<u32> = vertex_at_0(s_15, id_4);
        before_3 = _S102;
    }
    var _S103 : u32 = (extractBits((group_places_0[s_15]), u32((i32(22))), u32((i32(6)))));
    put_vertex_0(s_15, id_4, (before_3 | ((put_field_0(c_4 * _S103, inside_0)))));
    return;
}

fn read_chain_0( chain_0 : Chain_0,  s_16 : u32)
{
    var _S104 : u32 = (extractBits((group_stream_0[s_16]), u32((i32(0))), u32((i32(3)))));
    var _S105 : u32 = (extractBits((group_stream_0[s_16]), u32((i32(9))), u32((i32(3)))));
    var vectors_0 : bool = is_packed_0(s_16);
    var _S106 : u32 = (extractBits((group_places_0[s_16]), u32((i32(22))), u32((i32(6)))));
    var _S107 : u32 = bits_mask_0(s_16);
    var from_2 : vec2<u32>;
    if(vectors_0)
    {
        var _S108 : vec2<u32> = vertex_at_0(s_16, chain_0.from_0);
        from_2 = _S108;
    }
    else
    {
        from_2 = vec2<u32>(u32(0));
    }
    var _S109 : vec2<u32>;
    if(vectors_0)
    {
        var _S110 : vec2<u32> = vertex_at_0(s_16, chain_0.to_0);
        _S109 = _S110;
    }
    else
    {
        _S109 = vec2<u32>(u32(0));
    }
    var rest_2 : vec2<u32> = chain_0.inner_0;
    var a_2 : u32 = chain_0.from_0;
    var beyond_0 : vec2<u32> = from_2;
    var o_1 : u32 = chain_0.from_0;
    var left_1 : u32 = chain_0.steps_2;
    for(;;)
    {
        var _S111 : bool;
        if(mask_any_0(rest_2))
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
        var _S112 : u32;
        if(chain_0.backwards_0)
        {
            _S112 = mask_msb_0(rest_2);
        }
        else
        {
            _S112 = mask_lsb_0(rest_2);
        }
        var id_5 : u32 = (_S112 & (u32(63)));
        var _S113 : vec2<u32> = (rest_2 & ((~mask_bit_0(id_5))));
        var weights_0 : Weights_0;
        weights_0.exist_0 = false;
        var _S114 : vec2<u32> = vec2<u32>(u32(0));
        var c_5 : u32 = u32(0);
        var fields_2 : vec2<u32> = _S114;
        for(;;)
        {
            if(c_5 < _S104)
            {
            }
            else
            {
                break;
            }
            var at_4 : u32 = c_5 * _S106;
            var prev_0 : u32;
            if(vectors_0)
            {
                prev_0 = get_field_0(from_2, at_4, _S106);
            }
            else
            {
                var _S115 : u32 = value_at_0(s_16, c_5, a_2);
                prev_0 = _S115;
            }
            var point_0 : u32;
            if(_S105 != u32(2))
            {
                if(vectors_0)
                {
                    point_0 = get_field_0(_S109, at_4, _S106);
                }
                else
                {
                    var _S116 : u32 = value_at_0(s_16, c_5, chain_0.to_0);
                    point_0 = _S116;
                }
                var before_4 : u32;
                if(vectors_0)
                {
                    before_4 = get_field_0(beyond_0, at_4, _S106);
                }
                else
                {
                    var _S117 : u32 = value_at_0(s_16, c_5, o_1);
                    before_4 = _S117;
                }
                var _S118 : u32 = affine_chain_point_0(weights_0, prev_0, point_0, before_4, max(left_1, u32(1)));
                point_0 = _S118;
            }
            else
            {
                point_0 = prev_0;
            }
            var _S119 : u32 = next_residual_0(c_5);
            var value_5 : u32 = ((point_0 + _S119) & (_S107));
            if(vectors_0)
            {
                fields_2 = (fields_2 | ((put_field_0(at_4, value_5))));
            }
            else
            {
                put_value_0(s_16, c_5, id_5, value_5);
            }
            c_5 = c_5 + u32(1);
        }
        if(vectors_0)
        {
            put_vertex_0(s_16, id_5, fields_2);
        }
        var _S120 : u32 = left_1 - u32(1);
        rest_2 = _S113;
        beyond_0 = from_2;
        from_2 = fields_2;
        o_1 = a_2;
        a_2 = id_5;
        left_1 = _S120;
    }
    return;
}

fn read_seams_0( h_7 : Header_0,  s_17 : u32)
{
    var rest_3 : vec2<u32> = seam_references_0(h_7, s_17);
    for(;;)
    {
        if(mask_any_0(rest_3))
        {
        }
        else
        {
            break;
        }
        var r_3 : u32 = mask_lsb_0(rest_3);
        var run_2 : Run_0 = run_of_0(r_3);
        read_chain_0(Chain_x24init_0(run_2.steps_0, id_at_0(run_2.rank_0), last_id_0(h_7, r_3, run_2), inner_ids_0(run_2), false), s_17);
        rest_3 = mask_clear_lsb_0(rest_3);
    }
    return;
}

fn job_triangles_0() -> u32
{
    return u32(64) * job_place_0;
}

fn pack4_0( x_2 : u32,  y_0 : u32,  z_0 : u32,  w_7 : u32) -> u32
{
    return (((((x_2 | (((y_0 << (u32(8))))))) | (((z_0 << (u32(16))))))) | (((w_7 << (u32(24))))));
}

fn traversed_prediction_0( predictor_0 : u32,  a_3 : u32,  b_2 : u32,  o_2 : u32,  across_0 : bool) -> u32
{
    if(predictor_0 == u32(2))
    {
        return a_3;
    }
    var sum_2 : u32 = a_3 + b_2;
    var _S121 : bool;
    if(predictor_0 == u32(1))
    {
        _S121 = true;
    }
    else
    {
        _S121 = !across_0;
    }
    if(_S121)
    {
        return (sum_2 >> (u32(1)));
    }
    if(predictor_0 == u32(3))
    {
        return u32((i32(u32(3) * sum_2 - u32(2) * o_2 + u32(2)) >> (u32(2))));
    }
    return sum_2 - o_2;
}

fn read_traversed_0( s_18 : u32,  triangle_0 : u32)
{
    var _S122 : u32 = (extractBits((group_stream_0[s_18]), u32((i32(0))), u32((i32(3)))));
    var predictor_1 : u32 = (extractBits((group_stream_0[s_18]), u32((i32(9))), u32((i32(3)))));
    var predicted_0 : bool = predictor_1 < u32(4);
    var a_4 : u32 = (triangle_0 & (u32(63)));
    var b_3 : u32 = (((triangle_0 >> (u32(8)))) & (u32(63)));
    var v_0 : u32 = (((triangle_0 >> (u32(16)))) & (u32(63)));
    var _S123 : u32 = (triangle_0 >> (u32(24)));
    var o_3 : u32 = (_S123 & (u32(63)));
    var _S124 : bool = _S123 != u32(255);
    var vectors_1 : bool = is_packed_0(s_18);
    var _S125 : u32 = (extractBits((group_places_0[s_18]), u32((i32(22))), u32((i32(6)))));
    var _S126 : u32 = bits_mask_0(s_18);
    var loads_0 : bool;
    if(vectors_1)
    {
        loads_0 = predicted_0;
    }
    else
    {
        loads_0 = false;
    }
    var _S127 : vec2<u32>;
    if(loads_0)
    {
        var _S128 : vec2<u32> = vertex_at_0(s_18, a_4);
        _S127 = _S128;
    }
    else
    {
        _S127 = vec2<u32>(u32(0));
    }
    var _S129 : vec2<u32>;
    if(loads_0)
    {
        var _S130 : vec2<u32> = vertex_at_0(s_18, b_3);
        _S129 = _S130;
    }
    else
    {
        _S129 = vec2<u32>(u32(0));
    }
    var _S131 : vec2<u32>;
    if(loads_0)
    {
        var _S132 : vec2<u32> = vertex_at_0(s_18, o_3);
        _S131 = _S132;
    }
    else
    {
        _S131 = vec2<u32>(u32(0));
    }
    var _S133 : vec2<u32> = vec2<u32>(u32(0));
    var c_6 : u32 = u32(0);
    var fields_3 : vec2<u32> = _S133;
    for(;;)
    {
        if(c_6 < _S122)
        {
        }
        else
        {
            break;
        }
        var at_5 : u32 = c_6 * _S125;
        var value_6 : u32 = next_residual_0(c_6);
        var value_7 : u32;
        if(predicted_0)
        {
            var known_0 : vec3<u32>;
            if(vectors_1)
            {
                known_0 = vec3<u32>(get_field_0(_S127, at_5, _S125), get_field_0(_S129, at_5, _S125), get_field_0(_S131, at_5, _S125));
            }
            else
            {
                var _S134 : u32 = value_at_0(s_18, c_6, a_4);
                var _S135 : u32 = value_at_0(s_18, c_6, b_3);
                var _S136 : u32 = value_at_0(s_18, c_6, o_3);
                known_0 = vec3<u32>(_S134, _S135, _S136);
            }
            value_7 = value_6 + traversed_prediction_0(predictor_1, known_0.x, known_0.y, known_0.z, _S124);
        }
        else
        {
            value_7 = value_6;
        }
        if(vectors_1)
        {
            fields_3 = (fields_3 | ((put_field_0(at_5, (value_7 & (_S126))))));
        }
        else
        {
            put_value_0(s_18, c_6, v_0, value_7);
        }
        c_6 = c_6 + u32(1);
    }
    if(vectors_1)
    {
        put_vertex_0(s_18, v_0, fields_3);
    }
    return;
}

fn read_all_traversed_0( s_19 : u32,  waiting_1 : vec2<u32>)
{
    var rest_4 : vec2<u32>;
    if(mask_any_0(waiting_1))
    {
        rest_4 = mask_below_0(triangle_count_0);
    }
    else
    {
        rest_4 = symbol_c_0;
    }
    var following_0 : u32 = all_triangles_0[job_triangles_0() + (((mask_lsb_0(rest_4)) & (u32(63))))];
    var _S137 : vec2<u32> = waiting_1;
    for(;;)
    {
        var _S138 : bool;
        if(mask_any_0(rest_4))
        {
            _S138 = error_0 == u32(0);
        }
        else
        {
            _S138 = false;
        }
        if(_S138)
        {
        }
        else
        {
            break;
        }
        var t_1 : u32 = mask_lsb_0(rest_4);
        var a_5 : u32 = (following_0 & (u32(63)));
        var b_4 : u32 = (((following_0 >> (u32(8)))) & (u32(63)));
        var v_1 : u32 = (((following_0 >> (u32(16)))) & (u32(63)));
        var _S139 : bool;
        if(mask_test_0(the_starts_0, t_1))
        {
            _S139 = mask_test_0(_S137, a_5);
        }
        else
        {
            _S139 = false;
        }
        var triangle_1 : u32;
        var introduces_0 : bool;
        if(_S139)
        {
            var _S140 : vec2<u32> = (_S137 & ((~mask_bit_0(a_5))));
            var _S141 : u32 = pack4_0(b_4, b_4, a_5, b_4);
            introduces_0 = true;
            triangle_1 = _S141;
            _S137 = _S140;
        }
        else
        {
            var rest_5 : vec2<u32> = mask_clear_lsb_0(rest_4);
            var _S142 : u32 = all_triangles_0[job_triangles_0() + (((mask_lsb_0(rest_5)) & (u32(63))))];
            if(mask_test_0(symbol_c_0, t_1))
            {
                introduces_0 = true;
            }
            else
            {
                introduces_0 = mask_test_0(_S137, v_1);
            }
            var _S143 : vec2<u32> = (_S137 & ((~mask_bit_0(v_1))));
            triangle_1 = following_0;
            rest_4 = rest_5;
            following_0 = _S142;
            _S137 = _S143;
        }
        if(introduces_0)
        {
            read_traversed_0(s_19, triangle_1);
        }
    }
    if(mask_any_0(_S137))
    {
        error_0 = u32(2);
    }
    return;
}

fn close_pass_0()
{
    if(error_0 != u32(0))
    {
        var _S144 : u32 = atomicOr(&(the_summaries_0[job_place_0]), (error_0 << (u32(16))));
    }
    return;
}

@compute
@workgroup_size(64, 1, 1)
fn main(@builtin(local_invocation_index) gl_LocalInvocationIndex_0 : u32, @builtin(workgroup_id) gl_WorkGroupID_0 : vec3<u32>)
{
    _S3 = gl_LocalInvocationIndex_0;
    _S4 = gl_WorkGroupID_0;
    var _S145 : bool = open_pass_0();
    if(!_S145)
    {
        return;
    }
    var s_20 : u32 = _S4.y;
    var h_8 : Header_0 = open_header_0();
    var places_1 : Places_std430_0 = all_places_0[job_place_0];
    if((all_places_0[job_place_0].interior_0) == u32(4294967295))
    {
        return;
    }
    seek_residuals_0(h_8, places_1.interior_0, s_20, mask_count_0(symbol_c_0) + mask_count_0(places_1.waiting_0));
    read_seams_0(h_8, s_20);
    read_all_traversed_0(s_20, places_1.waiting_0);
    if((max(unary_0.cursor_0, low_position_0)) > (u32(8) * (byte_length_0 - u32(8))))
    {
        error_0 = u32(8);
    }
    close_pass_0();
    return;
}

