// Translated from shaders/decoders/chains.comp by web/build_wgsl.py: do not edit.
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

fn nth_bit_0( m_2 : vec2<u32>,  n_2 : u32) -> u32
{
    var _S32 : u32 = m_2.x;
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
        word_0 = m_2.y;
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

fn mask_any_0( m_3 : vec2<u32>) -> bool
{
    return (((m_3.x) | ((m_3.y)))) != u32(0);
}

fn mask_lsb_0( m_4 : vec2<u32>) -> u32
{
    var _S37 : u32 = m_4.x;
    var _S38 : u32;
    if(_S37 != u32(0))
    {
        _S38 = firstbitlow_0(_S37);
    }
    else
    {
        var _S39 : u32 = m_4.y;
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

fn mask_count_0( m_5 : vec2<u32>) -> u32
{
    return countOneBits(m_5.x) + countOneBits(m_5.y);
}

struct Run_0
{
     rank_0 : u32,
     steps_0 : u32,
};

fn Run_x24init_0( rank_1 : u32,  steps_1 : u32) -> Run_0
{
    var _S40 : Run_0;
    _S40.rank_0 = rank_1;
    _S40.steps_0 = steps_1;
    return _S40;
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

fn mask_test_0( m_6 : vec2<u32>,  i_4 : u32) -> bool
{
    var _S41 : u32;
    if(((i_4 & (u32(32)))) == u32(0))
    {
        _S41 = m_6.x;
    }
    else
    {
        _S41 = m_6.y;
    }
    return ((((_S41 >> (((i_4 & (u32(31))))))) & (u32(1)))) != u32(0);
}

fn entry_position_0( h_2 : Header_0,  r_1 : u32) -> u32
{
    return h_2.entries_1 + h_2.entry_width_0 * mask_count_0(((h_2.foreign_refs_1) & ((mask_below_0(r_1)))));
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

fn entry_owner_0( h_3 : Header_0,  entry_0 : u32) -> u32
{
    var delta_0 : u32 = load_bits_0(entry_0, h_3.delta_width_0);
    var _S42 : bool = delta_0 > (h_3.meshlet_0);
    if(_S42)
    {
        error_0 = u32(5);
    }
    var _S43 : u32;
    if(_S42)
    {
        _S43 = u32(0);
    }
    else
    {
        _S43 = h_3.meshlet_0 - delta_0;
    }
    return _S43;
}

fn entry_slot_0( h_4 : Header_0,  entry_1 : u32) -> u32
{
    return load_bits_0(entry_1 + h_4.delta_width_0, h_4.slot_width_0);
}

fn mask_clear_lsb_0( m_7 : vec2<u32>) -> vec2<u32>
{
    var _S44 : u32 = m_7.x;
    var _S45 : vec2<u32>;
    if(_S44 != u32(0))
    {
        _S45 = vec2<u32>((_S44 & ((_S44 - u32(1)))), m_7.y);
    }
    else
    {
        var _S46 : u32 = m_7.y;
        _S45 = vec2<u32>(u32(0), (_S46 & ((_S46 - u32(1)))));
    }
    return _S45;
}

fn slot_reference_0( h_5 : Header_0,  slot_0 : u32) -> u32
{
    var rest_0 : vec2<u32> = h_5.owned_refs_0;
    var i_6 : u32 = u32(0);
    for(;;)
    {
        var _S47 : bool;
        if(i_6 < slot_0)
        {
            _S47 = mask_any_0(rest_0);
        }
        else
        {
            _S47 = false;
        }
        if(_S47)
        {
        }
        else
        {
            break;
        }
        var _S48 : vec2<u32> = mask_clear_lsb_0(rest_0);
        var _S49 : u32 = i_6 + u32(1);
        rest_0 = _S48;
        i_6 = _S49;
    }
    if(!mask_any_0(rest_0))
    {
        error_0 = u32(5);
    }
    return mask_lsb_0(rest_0);
}

fn load_words3_0( i_7 : u32) -> vec3<u32>
{
    return vec3<u32>(load_memory_0(i_7), load_memory_0(i_7 + u32(1)), load_memory_0(i_7 + u32(2)));
}

fn load_mask_0( p_1 : u32,  n_4 : u32) -> vec2<u32>
{
    var words_3 : vec3<u32> = load_words3_0((p_1 >> (u32(5))));
    var _S50 : u32 = words_3.y;
    var _S51 : u32 = (p_1 & (u32(31)));
    return (vec2<u32>(funnel_0(words_3.x, _S50, _S51), funnel_0(_S50, words_3.z, _S51)) & ((mask_below_0(n_4))));
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

fn chain_vertices_0( h_6 : Header_0,  reference_0 : u32) -> vec2<u32>
{
    var _S52 : vec2<u32> = vec2<u32>(u32(0));
    var _S53 : vec2<u32> = load_mask_0(h_6.lengths_1, u32(64));
    var rest_1 : vec2<u32> = h_6.sized_refs_0;
    var window_0 : vec2<u32> = _S53;
    var used_0 : u32 = u32(0);
    var p_2 : u32 = h_6.lengths_1;
    var count_0 : vec2<u32> = _S52;
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
        if((used_0 + h_6.length_width_0) > u32(64))
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
        var r_2 : u32 = mask_lsb_0(rest_1);
        var inner_0 : u32;
        if(mask_test_0(h_6.owned_refs_0, r_2))
        {
            inner_0 = get_field_0(window_0, used_1, h_6.length_width_0);
        }
        else
        {
            inner_0 = u32(0);
        }
        var _S54 : u32;
        if(r_2 < reference_0)
        {
            _S54 = inner_0;
        }
        else
        {
            _S54 = u32(0);
        }
        var count_1 : vec2<u32> = count_0 + vec2<u32>(inner_0, _S54);
        var used_2 : u32 = used_1 + h_6.length_width_0;
        rest_1 = mask_clear_lsb_0(rest_1);
        used_0 = used_2;
        count_0 = count_1;
    }
    return count_0;
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

fn places_of_0( m_8 : u32) -> Places_0
{
    var _S55 : Places_0 = Places_0( all_places_0[m_8].foreign_refs_0, all_places_0[m_8].private_refs_0, all_places_0[m_8].loop_ends_0, all_places_0[m_8].counts_0, all_places_0[m_8].lengths_0, all_places_0[m_8].entries_0, all_places_0[m_8].codes_0, all_places_0[m_8].anchors_0, all_places_0[m_8].chains_0, all_places_0[m_8].quotients_0, all_places_0[m_8].interior_0, all_places_0[m_8].waiting_0 );
    if((all_places_0[m_8].quotients_0) == u32(4294967295))
    {
        error_0 = u32(7);
    }
    return _S55;
}

struct Source_0
{
     total_0 : u32,
     first_1 : u32,
     codes_2 : u32,
     low_2 : u32,
     quotients_1 : u32,
};

fn Source_x24init_0( total_1 : u32,  first_2 : u32,  codes_3 : u32,  low_3 : u32,  quotients_2 : u32) -> Source_0
{
    var _S56 : Source_0;
    _S56.total_0 = total_1;
    _S56.first_1 = first_2;
    _S56.codes_2 = codes_3;
    _S56.low_2 = low_3;
    _S56.quotients_1 = quotients_2;
    return _S56;
}

fn source_of_0( h_7 : Header_0,  r_3 : u32) -> Source_0
{
    var foreign_0 : bool = mask_test_0(h_7.foreign_refs_1, r_3);
    var entry_2 : u32 = entry_position_0(h_7, r_3);
    var reference_1 : u32;
    if(foreign_0)
    {
        var _S57 : u32 = entry_owner_0(h_7, entry_2);
        reference_1 = _S57;
    }
    else
    {
        reference_1 = h_7.meshlet_0;
    }
    var owner_0 : Header_0 = header_of_0(reference_1);
    if(foreign_0)
    {
        var _S58 : u32 = slot_reference_0(owner_0, entry_slot_0(h_7, entry_2));
        reference_1 = (_S58 & (u32(63)));
    }
    else
    {
        reference_1 = r_3;
    }
    var vertices_0 : vec2<u32> = chain_vertices_0(owner_0, reference_1);
    var places_1 : Places_0 = places_of_0(owner_0.meshlet_0);
    return Source_x24init_0(vertices_0.x, vertices_0.y, places_1.codes_0, places_1.chains_0, places_1.quotients_0);
}

fn id_at_0( rank_3 : u32) -> u32
{
    return nth_bit_0(the_boundary_0, rank_3);
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

fn loop_of_0( h_8 : Header_0,  r_4 : u32) -> vec2<u32>
{
    var k_1 : u32 = mask_count_0(((h_8.loop_ends_2) & ((mask_below_0(r_4)))));
    return vec2<u32>(mask_count_0((the_boundary_0 & ((mask_below_0(ids_before_0(k_1)))))), mask_count_0((the_boundary_0 & ((mask_below_0(ids_before_0(k_1 + u32(1))))))));
}

fn last_id_0( h_9 : Header_0,  r_5 : u32,  run_0 : Run_0) -> u32
{
    var _S59 : u32;
    if(mask_test_0(h_9.loop_ends_2, r_5))
    {
        _S59 = loop_of_0(h_9, r_5).x;
    }
    else
    {
        _S59 = run_0.rank_0 + run_0.steps_0;
    }
    return id_at_0(_S59);
}

fn inner_ids_0( run_1 : Run_0) -> vec2<u32>
{
    return (((the_boundary_0 & ((~mask_below_0(id_at_0(run_1.rank_0) + u32(1)))))) & ((mask_below_0(id_at_0(run_1.rank_0 + run_1.steps_0 - u32(1)) + u32(1)))));
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
    var _S60 : Chain_0;
    _S60.steps_2 = steps_3;
    _S60.from_0 = from_1;
    _S60.to_0 = to_1;
    _S60.inner_1 = inner_2;
    _S60.backwards_0 = backwards_1;
    return _S60;
}

fn chain_of_0( h_10 : Header_0,  r_6 : u32,  run_2 : Run_0) -> Chain_0
{
    var foreign_1 : bool = mask_test_0(h_10.foreign_refs_1, r_6);
    var begin_1 : u32 = id_at_0(run_2.rank_0);
    var end_2 : u32 = last_id_0(h_10, r_6, run_2);
    var inner_3 : vec2<u32> = inner_ids_0(run_2);
    var _S61 : u32;
    if(foreign_1)
    {
        _S61 = end_2;
    }
    else
    {
        _S61 = begin_1;
    }
    var _S62 : u32;
    if(foreign_1)
    {
        _S62 = begin_1;
    }
    else
    {
        _S62 = end_2;
    }
    return Chain_x24init_0(run_2.steps_0, _S61, _S62, inner_3, foreign_1);
}

fn code_at_0( p_4 : ptr<function, u32>,  s_4 : u32,  of_chains_0 : bool) -> u32
{
    var field_2 : u32 = load_bits_0((*p_4), u32(3));
    (*p_4) = (*p_4) + u32(3);
    if(field_2 == u32(7))
    {
        var _S63 : u32 = (extractBits((group_stream_0[s_4]), u32((i32(0))), u32((i32(3)))));
        (*p_4) = (*p_4) + u32(5) * _S63;
        return u32(255);
    }
    var base_1 : u32;
    if(of_chains_0)
    {
        var _S64 : u32 = (extractBits((group_bases_0[s_4]), u32((i32(0))), u32((i32(5)))));
        base_1 = _S64;
    }
    else
    {
        var _S65 : u32 = (extractBits((group_bases_0[s_4]), u32((i32(8))), u32((i32(5)))));
        base_1 = _S65;
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
    var _S66 : u32 = (k_2 & (u32(31)));
    if(rice_0)
    {
        base_1 = u32(0);
    }
    else
    {
        base_1 = u32(32);
    }
    return (_S66 | (base_1));
}

fn width_field_0( position_0 : u32) -> u32
{
    var w_0 : u32 = load_bits_0(position_0, u32(5));
    var _S67 : u32;
    if(w_0 == u32(31))
    {
        _S67 = u32(32);
    }
    else
    {
        _S67 = w_0;
    }
    return _S67;
}

fn fixed_width_0( elements_0 : u32,  widths_0 : u32) -> u32
{
    var c_0 : u32 = u32(0);
    var sum_0 : u32 = u32(0);
    for(;;)
    {
        if(c_0 < elements_0)
        {
        }
        else
        {
            break;
        }
        var sum_1 : u32 = sum_0 + width_field_0(widths_0 + u32(5) * c_0);
        c_0 = c_0 + u32(1);
        sum_0 = sum_1;
    }
    return sum_0;
}

fn low_width_0( code_0 : u32,  elements_1 : u32,  widths_1 : u32) -> u32
{
    var _S68 : u32;
    if(code_0 == u32(255))
    {
        _S68 = fixed_width_0(elements_1, widths_1);
    }
    else
    {
        _S68 = code_0 * elements_1;
    }
    return _S68;
}

fn mask_none_0() -> vec2<u32>
{
    return vec2<u32>(u32(0));
}

fn seam_references_0( h_11 : Header_0,  s_5 : u32) -> vec2<u32>
{
    var seams_0 : vec2<u32> = mask_none_0();
    var _S69 : bool;
    if(s_5 == u32(0))
    {
        _S69 = true;
    }
    else
    {
        _S69 = (((h_11.flags_0) & (u32(4)))) == u32(0);
    }
    if(_S69)
    {
        return seams_0;
    }
    var _S70 : u32 = h_11.entries_1 + h_11.delta_width_0 + h_11.slot_width_0 + s_5 - u32(1);
    var rest_2 : vec2<u32> = h_11.foreign_refs_1;
    var seams_1 : vec2<u32> = seams_0;
    var share_0 : u32 = _S70;
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

fn after_ones_0( p_5 : u32,  n_5 : u32) -> u32
{
    if(n_5 == u32(0))
    {
        return p_5;
    }
    var w_1 : u32 = (p_5 >> (u32(5)));
    var word_1 : u32 = ((load_word_0(w_1)) & ((~word_below_0((p_5 & (u32(31)))))));
    var ones_1 : u32 = countOneBits(word_1);
    var empty_0 : u32 = u32(0);
    var _S71 : u32 = n_5;
    var w_2 : u32 = w_1;
    var word_2 : u32 = word_1;
    for(;;)
    {
        if(ones_1 < _S71)
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
        var _S72 : bool;
        if(w_2 >= (push_0.blob_words_0))
        {
            _S72 = true;
        }
        else
        {
            _S72 = empty_0 > u32(512);
        }
        if(_S72)
        {
            error_0 = u32(8);
            return p_5;
        }
        var _S73 : u32 = _S71 - ones_1;
        var w_3 : u32 = w_2 + u32(1);
        var word_3 : u32 = load_word_0(w_3);
        ones_1 = countOneBits(word_3);
        _S71 = _S73;
        w_2 = w_3;
        word_2 = word_3;
    }
    ones_1 = _S71;
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

struct UnaryReader_0
{
     window_1 : u32,
     base_2 : u32,
     cursor_0 : u32,
};

fn UnaryReader_x24init_0( window_2 : u32,  base_3 : u32,  cursor_1 : u32) -> UnaryReader_0
{
    var _S74 : UnaryReader_0;
    _S74.window_1 = window_2;
    _S74.base_2 = base_3;
    _S74.cursor_0 = cursor_1;
    return _S74;
}

fn seek_unary_0( p_6 : u32) -> UnaryReader_0
{
    return UnaryReader_x24init_0(((load_word_0((p_6 >> (u32(5))))) & ((~word_below_0((p_6 & (u32(31))))))), (p_6 & (u32(4294967264))), p_6);
}

var<private> unary_0 : UnaryReader_0;

var<private> residual_code_0 : u32;

fn put_field_0( at_3 : u32,  value_3 : u32) -> vec2<u32>
{
    var _S75 : vec2<u32>;
    if(at_3 < u32(32))
    {
        _S75 = vec2<u32>((value_3 << (at_3)), (((value_3 >> (u32(1)))) >> ((u32(31) - at_3))));
    }
    else
    {
        _S75 = vec2<u32>(u32(0), (value_3 << ((at_3 - u32(32)))));
    }
    return _S75;
}

fn fixed_widths_0( position_1 : u32,  n_6 : u32) -> vec2<u32>
{
    var _S76 : vec2<u32> = vec2<u32>(u32(0));
    var c_1 : u32 = u32(0);
    var widths_2 : vec2<u32> = _S76;
    for(;;)
    {
        if(c_1 < n_6)
        {
        }
        else
        {
            break;
        }
        var widths_3 : vec2<u32> = (widths_2 | ((put_field_0(u32(6) * c_1, width_field_0(position_1 + u32(5) * c_1)))));
        c_1 = c_1 + u32(1);
        widths_2 = widths_3;
    }
    return widths_2;
}

var<private> residual_widths_0 : vec2<u32>;

var<private> low_position_0 : u32;

var<private> low_index_0 : u32;

var<private> low_words_0 : vec2<u32>;

fn seek_low_0( p_7 : u32)
{
    low_position_0 = p_7;
    var _S77 : u32 = (p_7 >> (u32(5)));
    low_index_0 = _S77;
    low_words_0 = load_words2_0(_S77);
    return;
}

fn is_packed_0( s_6 : u32) -> bool
{
    var _S78 : u32 = (extractBits((group_places_0[s_6]), u32((i32(16))), u32((i32(6)))));
    return _S78 <= u32(2);
}

fn bits_mask_0( s_7 : u32) -> u32
{
    var _S79 : u32 = (extractBits((group_stream_0[s_7]), u32((i32(3))), u32((i32(6)))));
    return word_below_0(_S79);
}

fn word_of_0( s_8 : u32,  id_0 : u32) -> u32
{
    var _S80 : u32 = (extractBits((group_places_0[s_8]), u32((i32(0))), u32((i32(16)))));
    var _S81 : u32 = (extractBits((group_places_0[s_8]), u32((i32(16))), u32((i32(6)))));
    return _S80 + _S81 * ((id_0 & (u32(63))));
}

fn vertex_at_0( s_9 : u32,  id_1 : u32) -> vec2<u32>
{
    var word_5 : u32 = word_of_0(s_9, id_1);
    var _S82 : u32 = (extractBits((group_places_0[s_9]), u32((i32(16))), u32((i32(6)))));
    if(_S82 == u32(1))
    {
        return vec2<u32>(all_values_0[the_values_0 + word_5], u32(0));
    }
    var _S83 : u32 = u32(2) * ((word_5 >> (u32(1))));
    return vec2<u32>(all_values_0[the_values_0 + _S83], all_values_0[the_values_0 + _S83 + u32(1)]);
}

fn mask_msb_0( m_9 : vec2<u32>) -> u32
{
    var _S84 : u32 = m_9.y;
    var _S85 : u32;
    if(_S84 != u32(0))
    {
        _S85 = u32(32) + firstbithigh_0(_S84);
    }
    else
    {
        var _S86 : u32 = m_9.x;
        if(_S86 != u32(0))
        {
            _S85 = firstbithigh_0(_S86);
        }
        else
        {
            _S85 = u32(64);
        }
    }
    return _S85;
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
    var _S87 : Triple_0;
    _S87.x_1 = x_2;
    _S87.y_1 = y_2;
    _S87.z_1 = z_2;
    return _S87;
}

fn grid_position_0( id_2 : u32) -> Triple_0
{
    var word_6 : u32 = word_of_0(u32(0), id_2);
    var _S88 : bool = is_packed_0(u32(0));
    if(!_S88)
    {
        return Triple_x24init_0(all_values_0[the_values_0 + word_6], all_values_0[the_values_0 + (word_6 + u32(1))], all_values_0[the_values_0 + (word_6 + u32(2))]);
    }
    var _S89 : u32 = u32(2) * ((word_6 >> (u32(1))));
    return Triple_x24init_0((all_values_0[the_values_0 + _S89] & (u32(2097151))), (((((all_values_0[the_values_0 + _S89] >> (u32(21)))) | (((all_values_0[the_values_0 + _S89 + u32(1)] << (u32(11))))))) & (u32(2097151))), (((all_values_0[the_values_0 + _S89 + u32(1)] >> (u32(10)))) & (u32(2097151))));
}

fn difference_0( to_2 : Triple_0,  from_2 : Triple_0) -> Triple_0
{
    var _S90 : Triple_0 = to_2;
    _S90.x_1 = _S90.x_1 - from_2.x_1;
    _S90.y_1 = _S90.y_1 - from_2.y_1;
    _S90.z_1 = _S90.z_1 - from_2.z_1;
    return _S90;
}

fn magnitude_0( x_3 : u32) -> u32
{
    var _S91 : u32;
    if(i32(x_3) < i32(0))
    {
        _S91 = u32(0) - x_3;
    }
    else
    {
        _S91 = x_3;
    }
    return _S91;
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
    var _S92 : u32;
    if(x_5 > y_3)
    {
        _S92 = x_5 - y_3;
    }
    else
    {
        _S92 = u32(0);
    }
    return _S92;
}

fn shift_right_0( x_6 : u32,  n_7 : u32) -> u32
{
    return u32((i32(x_6) >> (n_7)));
}

fn shifted_0( v_1 : Triple_0,  n_8 : u32) -> Triple_0
{
    var _S93 : Triple_0 = v_1;
    _S93.x_1 = shift_right_0(_S93.x_1, n_8);
    _S93.y_1 = shift_right_0(_S93.y_1, n_8);
    _S93.z_1 = shift_right_0(_S93.z_1, n_8);
    return _S93;
}

fn dot3_0( v_2 : Triple_0,  w_5 : Triple_0) -> u32
{
    return v_2.x_1 * w_5.x_1 + v_2.y_1 * w_5.y_1 + v_2.z_1 * w_5.z_1;
}

fn signed_quotient_0( x_7 : u32,  d_0 : u32) -> u32
{
    var quotient_0 : u32 = magnitude_0(x_7) / d_0;
    var _S94 : u32;
    if(i32(x_7) < i32(0))
    {
        _S94 = u32(0) - quotient_0;
    }
    else
    {
        _S94 = quotient_0;
    }
    return _S94;
}

struct Weights_0
{
     exist_0 : bool,
     s_10 : u32,
     u_0 : u32,
};

fn affine_weights_0( a_0 : u32,  b_0 : u32,  o_0 : u32,  v_3 : u32) -> Weights_0
{
    var origin_0 : Triple_0 = grid_position_0(a_0);
    var _S95 : Triple_0 = grid_position_0(b_0);
    var e_0 : Triple_0 = difference_0(_S95, origin_0);
    var _S96 : Triple_0 = grid_position_0(o_0);
    var f_0 : Triple_0 = difference_0(_S96, origin_0);
    var _S97 : Triple_0 = grid_position_0(v_3);
    var r_7 : Triple_0 = difference_0(_S97, origin_0);
    var h_12 : u32 = excess_0(bit_length_0(((((magnitudes_0(e_0)) | ((magnitudes_0(f_0))))) | ((magnitudes_0(r_7))))), u32(14));
    var e_1 : Triple_0 = shifted_0(e_0, h_12);
    var f_1 : Triple_0 = shifted_0(f_0, h_12);
    var r_8 : Triple_0 = shifted_0(r_7, h_12);
    var ee_0 : u32 = dot3_0(e_1, e_1);
    var ff_0 : u32 = dot3_0(f_1, f_1);
    var re_0 : u32 = dot3_0(r_8, e_1);
    var rf_0 : u32 = dot3_0(r_8, f_1);
    var n_9 : u32 = bit_length_0((((((ee_0 | (ff_0))) | ((magnitude_0(re_0))))) | ((magnitude_0(rf_0)))));
    var up_0 : u32 = excess_0(u32(15), n_9);
    var down_0 : u32 = excess_0(n_9, u32(15));
    var ee_1 : u32 = shift_right_0((ee_0 << (up_0)), down_0);
    var ef_0 : u32 = shift_right_0(((dot3_0(e_1, f_1)) << (up_0)), down_0);
    var ff_1 : u32 = shift_right_0((ff_0 << (up_0)), down_0);
    var re_1 : u32 = shift_right_0((re_0 << (up_0)), down_0);
    var rf_1 : u32 = shift_right_0((rf_0 << (up_0)), down_0);
    var product_0 : u32 = ee_1 * ff_1;
    var determinant_0 : u32 = product_0 - ef_0 * ef_0;
    var d_1 : u32 = (determinant_0 >> (u32(8)));
    var w_6 : Weights_0;
    var _S98 : bool;
    if(i32(determinant_0) > ((i32(product_0) >> (u32(5)))))
    {
        _S98 = d_1 != u32(0);
    }
    else
    {
        _S98 = false;
    }
    w_6.exist_0 = _S98;
    w_6.s_10 = u32(0);
    w_6.u_0 = u32(0);
    if(!_S98)
    {
        return w_6;
    }
    var _S99 : u32 = signed_quotient_0(re_1 * ff_1 - rf_1 * ef_0, d_1);
    w_6.s_10 = _S99;
    var _S100 : u32 = signed_quotient_0(rf_1 * ee_1 - re_1 * ef_0, d_1);
    w_6.u_0 = _S100;
    if((magnitude_0(_S99)) < u32(1024))
    {
        _S98 = (magnitude_0(w_6.u_0)) < u32(1024);
    }
    else
    {
        _S98 = false;
    }
    w_6.exist_0 = _S98;
    return w_6;
}

fn line_weights_0( a_1 : u32,  b_1 : u32,  v_4 : u32) -> Weights_0
{
    var origin_1 : Triple_0 = grid_position_0(a_1);
    var _S101 : Triple_0 = grid_position_0(b_1);
    var e_2 : Triple_0 = difference_0(_S101, origin_1);
    var _S102 : Triple_0 = grid_position_0(v_4);
    var r_9 : Triple_0 = difference_0(_S102, origin_1);
    var h_13 : u32 = excess_0(bit_length_0(((magnitudes_0(e_2)) | ((magnitudes_0(r_9))))), u32(10));
    var e_3 : Triple_0 = shifted_0(e_2, h_13);
    var ee_2 : u32 = dot3_0(e_3, e_3);
    var re_2 : u32 = dot3_0(shifted_0(r_9, h_13), e_3);
    var w_7 : Weights_0;
    var _S103 : i32 = i32(ee_2);
    var _S104 : bool;
    if(_S103 > i32(0))
    {
        _S104 = i32(re_2) >= i32(0);
    }
    else
    {
        _S104 = false;
    }
    if(_S104)
    {
        _S104 = i32(re_2) <= _S103;
    }
    else
    {
        _S104 = false;
    }
    w_7.exist_0 = _S104;
    w_7.s_10 = u32(0);
    w_7.u_0 = u32(0);
    if(_S104)
    {
        var _S105 : u32 = (re_2 * u32(256) + ((ee_2 >> (u32(1))))) / ee_2;
        w_7.s_10 = _S105;
    }
    return w_7;
}

fn chain_weights_0( step_0 : u32) -> Weights_0
{
    var v_5 : u32 = (step_0 & (u32(255)));
    var before_2 : u32 = (((step_0 >> (u32(8)))) & (u32(255)));
    var end_3 : u32 = (((step_0 >> (u32(16)))) & (u32(255)));
    var w_8 : Weights_0;
    w_8.exist_0 = false;
    w_8.s_10 = u32(0);
    w_8.u_0 = u32(0);
    var _S106 : u32 = (step_0 >> (u32(24)));
    if(_S106 != u32(255))
    {
        var _S107 : Weights_0 = affine_weights_0(before_2, end_3, _S106, v_5);
        w_8 = _S107;
    }
    if(!w_8.exist_0)
    {
        var _S108 : Weights_0 = line_weights_0(before_2, end_3, v_5);
        w_8 = _S108;
    }
    return w_8;
}

fn value_at_0( s_11 : u32,  c_2 : u32,  id_3 : u32) -> u32
{
    var _S109 : bool = is_packed_0(s_11);
    if(_S109)
    {
        var _S110 : vec2<u32> = vertex_at_0(s_11, id_3);
        var _S111 : u32 = (extractBits((group_places_0[s_11]), u32((i32(22))), u32((i32(6)))));
        var _S112 : u32 = c_2 * _S111;
        var _S113 : u32 = (extractBits((group_places_0[s_11]), u32((i32(22))), u32((i32(6)))));
        return get_field_0(_S110, _S112, _S113);
    }
    var _S114 : u32 = the_values_0;
    var _S115 : u32 = word_of_0(s_11, id_3);
    return all_values_0[_S114 + (_S115 + c_2)];
}

fn affine_point_0( w_9 : Weights_0,  a_2 : u32,  b_2 : u32,  o_1 : u32) -> u32
{
    return a_2 + shift_right_0(w_9.s_10 * (b_2 - a_2) + w_9.u_0 * (o_1 - a_2) + u32(128), u32(8));
}

fn divide_0( x_8 : u32,  n_10 : u32) -> u32
{
    var _S116 : u32 = x_8 / n_10;
    return _S116;
}

fn toward_0( a_3 : u32,  b_3 : u32,  n_11 : u32) -> u32
{
    var _S117 : u32 = divide_0(b_3 - a_3 + ((n_11 >> (u32(1)))) + ((n_11 << (u32(24)))), n_11);
    return a_3 + _S117 - u32(16777216);
}

fn affine_chain_point_0( w_10 : Weights_0,  before_3 : u32,  end_4 : u32,  earlier_0 : u32,  left_0 : u32) -> u32
{
    var _S118 : u32;
    if(w_10.exist_0)
    {
        _S118 = affine_point_0(w_10, before_3, end_4, earlier_0);
    }
    else
    {
        var _S119 : u32 = toward_0(before_3, end_4, left_0);
        _S118 = _S119;
    }
    return _S118;
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
        var _S120 : u32 = unary_0.base_2 + u32(32);
        unary_0.base_2 = _S120;
        var _S121 : bool;
        if(((_S120 >> (u32(5)))) >= (push_0.blob_words_0))
        {
            _S121 = true;
        }
        else
        {
            _S121 = (unary_0.base_2 - unary_0.cursor_0) > u32(16415);
        }
        if(_S121)
        {
            error_0 = u32(8);
            return u32(0);
        }
        unary_0.window_1 = load_word_0(((unary_0.base_2) >> (u32(5))));
    }
    var one_0 : u32 = unary_0.base_2 + firstbitlow_0(unary_0.window_1);
    var quotient_1 : u32 = one_0 - unary_0.cursor_0;
    unary_0.window_1 = ((unary_0.window_1) & ((unary_0.window_1 - u32(1))));
    unary_0.cursor_0 = one_0 + u32(1);
    if(quotient_1 > u32(16383))
    {
        error_0 = u32(8);
    }
    return quotient_1;
}

fn is_exponential_0( code_1 : u32) -> bool
{
    return ((code_1 & (u32(4294967264)))) == u32(32);
}

fn exponential_quotient_0( parameter_0 : u32,  q_0 : u32) -> u32
{
    var _S122 : bool;
    if(q_0 <= u32(31))
    {
        _S122 = (parameter_0 + q_0) <= u32(32);
    }
    else
    {
        _S122 = false;
    }
    if(_S122)
    {
        return q_0;
    }
    error_0 = u32(7);
    return u32(0);
}

fn take_low_0( width_0 : u32) -> u32
{
    var w_11 : u32 = (low_position_0 >> (u32(5)));
    if(w_11 != low_index_0)
    {
        var _S123 : u32;
        if(w_11 == (low_index_0 + u32(1)))
        {
            _S123 = low_words_0.y;
        }
        else
        {
            _S123 = load_word_0(w_11);
        }
        low_words_0 = vec2<u32>(_S123, load_word_0(w_11 + u32(1)));
        low_index_0 = w_11;
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
        var _S124 : u32 = next_quotient_0();
        above_0 = _S124;
    }
    if(is_exponential_0(residual_code_0))
    {
        var longer_0 : u32 = exponential_quotient_0(parameter_1, above_0);
        var width_2 : u32 = width_1 + longer_0;
        above_0 = ((u32(1) << (longer_0))) - u32(1);
        width_1 = width_2;
    }
    var _S125 : u32 = take_low_0(width_1);
    return unzigzag_0(_S125 + ((above_0 << (parameter_1))));
}

fn put_vertex_0( s_12 : u32,  id_4 : u32,  fields_1 : vec2<u32>)
{
    var word_7 : u32 = word_of_0(s_12, id_4);
    var _S126 : u32 = (extractBits((group_places_0[s_12]), u32((i32(16))), u32((i32(6)))));
    if(_S126 == u32(1))
    {
        all_values_0[the_values_0 + word_7] = fields_1.x;
    }
    else
    {
        var _S127 : u32 = u32(2) * ((word_7 >> (u32(1))));
        all_values_0[the_values_0 + _S127] = fields_1.x;
        all_values_0[the_values_0 + _S127 + u32(1)] = fields_1.y;
    }
    return;
}

fn put_value_0( s_13 : u32,  c_4 : u32,  id_5 : u32,  value_4 : u32)
{
    var _S128 : u32 = bits_mask_0(s_13);
    var inside_0 : u32 = (value_4 & (_S128));
    var _S129 : bool = is_packed_0(s_13);
    if(!_S129)
    {
        var _S130 : u32 = the_values_0;
        var _S131 : u32 = word_of_0(s_13, id_5);
        all_values_0[_S130 + (_S131 + c_4)] = inside_0;
        return;
    }
    var before_4 : vec2<u32>;
    if(c_4 == u32(0))
    {
        before_4 = vec2<u32>(u32(0));
    }
    else
    {
        var _S132 : vec2<u32> = vertex_at_0(s_13, id_5);
        before_4 = _S132;
    }
    var _S133 : u32 = (extractBits((group_places_0[s_13]), u32((i32(22))), u32((i32(6)))));
    put_vertex_0(s_13, id_5, (before_4 | ((put_field_0(c_4 * _S133, inside_0)))));
    return;
}

fn read_chain_0( chain_0 : Chain_0,  s_14 : u32)
{
    var _S134 : u32 = (extractBits((group_stream_0[s_14]), u32((i32(0))), u32((i32(3)))));
    var _S135 : u32 = (extractBits((group_stream_0[s_14]), u32((i32(9))), u32((i32(3)))));
    var vectors_0 : bool = is_packed_0(s_14);
    var _S136 : u32 = (extractBits((group_places_0[s_14]), u32((i32(22))), u32((i32(6)))));
    var _S137 : u32 = bits_mask_0(s_14);
    var from_3 : vec2<u32>;
    if(vectors_0)
    {
        var _S138 : vec2<u32> = vertex_at_0(s_14, chain_0.from_0);
        from_3 = _S138;
    }
    else
    {
        from_3 = vec2<u32>(u32(0));
    }
    var _S139 : vec2<u32>;
    if(vectors_0)
    {
        var _S140 : vec2<u32> = vertex_at_0(s_14, chain_0.to_0);
        _S139 = _S140;
    }
    else
    {
        _S139 = vec2<u32>(u32(0));
    }
    var rest_3 : vec2<u32> = chain_0.inner_1;
    var a_4 : u32 = chain_0.from_0;
    var o_2 : u32 = chain_0.from_0;
    var beyond_0 : vec2<u32> = from_3;
    var left_1 : u32 = chain_0.steps_2;
    for(;;)
    {
        var _S141 : bool;
        if(mask_any_0(rest_3))
        {
            _S141 = error_0 == u32(0);
        }
        else
        {
            _S141 = false;
        }
        if(_S141)
        {
        }
        else
        {
            break;
        }
        var _S142 : u32;
        if(chain_0.backwards_0)
        {
            _S142 = mask_msb_0(rest_3);
        }
        else
        {
            _S142 = mask_lsb_0(rest_3);
        }
        var id_6 : u32 = (_S142 & (u32(63)));
        var _S143 : vec2<u32> = (rest_3 & ((~mask_bit_0(id_6))));
        var weights_0 : Weights_0;
        weights_0.exist_0 = false;
        var c_5 : u32;
        if(_S135 == u32(5))
        {
            if(a_4 == (chain_0.from_0))
            {
                c_5 = u32(255);
            }
            else
            {
                c_5 = o_2;
            }
            var _S144 : Weights_0 = chain_weights_0(pack4_0(id_6, a_4, chain_0.to_0, c_5));
            weights_0 = _S144;
        }
        var _S145 : vec2<u32> = vec2<u32>(u32(0));
        c_5 = u32(0);
        var fields_2 : vec2<u32> = _S145;
        for(;;)
        {
            if(c_5 < _S134)
            {
            }
            else
            {
                break;
            }
            var at_4 : u32 = c_5 * _S136;
            var prev_0 : u32;
            if(vectors_0)
            {
                prev_0 = get_field_0(from_3, at_4, _S136);
            }
            else
            {
                var _S146 : u32 = value_at_0(s_14, c_5, a_4);
                prev_0 = _S146;
            }
            var point_0 : u32;
            if(_S135 != u32(2))
            {
                if(vectors_0)
                {
                    point_0 = get_field_0(_S139, at_4, _S136);
                }
                else
                {
                    var _S147 : u32 = value_at_0(s_14, c_5, chain_0.to_0);
                    point_0 = _S147;
                }
                var before_5 : u32;
                if(vectors_0)
                {
                    before_5 = get_field_0(beyond_0, at_4, _S136);
                }
                else
                {
                    var _S148 : u32 = value_at_0(s_14, c_5, o_2);
                    before_5 = _S148;
                }
                var _S149 : u32 = affine_chain_point_0(weights_0, prev_0, point_0, before_5, max(left_1, u32(1)));
                point_0 = _S149;
            }
            else
            {
                point_0 = prev_0;
            }
            var _S150 : u32 = next_residual_0(c_5);
            var value_5 : u32 = ((point_0 + _S150) & (_S137));
            if(vectors_0)
            {
                fields_2 = (fields_2 | ((put_field_0(at_4, value_5))));
            }
            else
            {
                put_value_0(s_14, c_5, id_6, value_5);
            }
            c_5 = c_5 + u32(1);
        }
        if(vectors_0)
        {
            put_vertex_0(s_14, id_6, fields_2);
        }
        var _S151 : u32 = left_1 - u32(1);
        rest_3 = _S143;
        o_2 = a_4;
        a_4 = id_6;
        beyond_0 = from_3;
        from_3 = fields_2;
        left_1 = _S151;
    }
    return;
}

fn read_chains_0( h_14 : Header_0,  r_10 : u32,  run_3 : Run_0)
{
    var _S152 : Source_0 = source_of_0(h_14, r_10);
    var source_0 : Source_0 = _S152;
    var _S153 : Chain_0 = chain_of_0(h_14, r_10, run_3);
    var s_15 : u32 = u32(0);
    var skipped_0 : u32 = u32(0);
    for(;;)
    {
        var _S154 : bool;
        if(s_15 < stream_end_0)
        {
            _S154 = error_0 == u32(0);
        }
        else
        {
            _S154 = false;
        }
        if(_S154)
        {
        }
        else
        {
            break;
        }
        var n_12 : u32 = (extractBits((group_stream_0[s_15]), u32((i32(0))), u32((i32(3)))));
        var _S155 : u32 = source_0.codes_2;
        var code_2 : u32 = code_at_0(&(_S155), s_15, true);
        var widths_4 : u32 = _S155 - u32(5) * n_12;
        var width_3 : u32 = low_width_0(code_2, n_12, widths_4);
        var _S156 : u32 = _S155;
        var _S157 : u32 = code_at_0(&(_S156), s_15, false);
        source_0.codes_2 = _S156;
        var _S158 : bool = code_2 == u32(255);
        var rice_1 : u32;
        if(_S158)
        {
            rice_1 = u32(0);
        }
        else
        {
            rice_1 = n_12;
        }
        if(mask_test_0(seam_references_0(h_14, s_15), r_10))
        {
            skipped_0 = skipped_0 + source_0.total_0 * rice_1;
        }
        else
        {
            var _S159 : bool = rice_1 > u32(0);
            var skipped_1 : u32;
            if(_S159)
            {
                var _S160 : u32 = after_ones_0(source_0.quotients_1, skipped_0 + source_0.first_1 * rice_1);
                unary_0 = seek_unary_0(_S160);
                skipped_1 = (source_0.total_0 - source_0.first_1 - (run_3.steps_0 - u32(1))) * rice_1;
            }
            else
            {
                skipped_1 = skipped_0;
            }
            residual_code_0 = code_2;
            var _S161 : vec2<u32>;
            if(_S158)
            {
                _S161 = fixed_widths_0(widths_4, n_12);
            }
            else
            {
                _S161 = vec2<u32>(u32(0));
            }
            residual_widths_0 = _S161;
            seek_low_0(source_0.low_2 + source_0.first_1 * width_3);
            read_chain_0(_S153, s_15);
            if(_S159)
            {
                source_0.quotients_1 = unary_0.cursor_0;
            }
            if((max(source_0.quotients_1, low_position_0)) > (u32(8) * (byte_length_0 - u32(8))))
            {
                error_0 = u32(8);
            }
            skipped_0 = skipped_1;
        }
        source_0.low_2 = source_0.low_2 + source_0.total_0 * width_3;
        s_15 = s_15 + u32(1);
    }
    return;
}

fn close_pass_0()
{
    if(error_0 != u32(0))
    {
        var _S162 : u32 = atomicOr(&(the_summaries_0[job_place_0]), (error_0 << (u32(16))));
    }
    return;
}

@compute
@workgroup_size(64, 1, 1)
fn main(@builtin(local_invocation_index) gl_LocalInvocationIndex_0 : u32, @builtin(workgroup_id) gl_WorkGroupID_0 : vec3<u32>)
{
    _S3 = gl_LocalInvocationIndex_0;
    _S4 = gl_WorkGroupID_0;
    var _S163 : bool = open_pass_0();
    if(!_S163)
    {
        return;
    }
    var _S164 : Header_0 = open_header_0();
    var r_11 : u32 = part_0;
    for(;;)
    {
        var _S165 : bool;
        if(r_11 < (_S164.references_1))
        {
            _S165 = error_0 == u32(0);
        }
        else
        {
            _S165 = false;
        }
        if(_S165)
        {
        }
        else
        {
            break;
        }
        var run_4 : Run_0 = run_of_0(r_11);
        var _S166 : bool;
        if(!mask_test_0(_S164.private_refs_1, r_11))
        {
            _S166 = (run_4.steps_0) > u32(1);
        }
        else
        {
            _S166 = false;
        }
        if(_S166)
        {
            read_chains_0(_S164, r_11, run_4);
        }
        r_11 = r_11 + u32(8);
    }
    close_pass_0();
    return;
}

