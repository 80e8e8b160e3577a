// Translated from shaders/decoders/interior.comp by web/build_wgsl.py: do not edit.
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

@binding(3) @group(0) var<storage, read_write> all_triangles_0 : array<u32>;

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

var<workgroup> shared_uniform_0 : u32;

fn uniform_word_0( word_0 : u32) -> u32
{
    if(the_thread_0 == u32(0))
    {
        shared_uniform_0 = word_0;
    }
    var _S3 : u32 = (workgroupUniformLoad(&((shared_uniform_0))));
    return _S3;
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

var<workgroup> shared_stream_0 : array<u32, i32(8)>;

var<workgroup> shared_bases_0 : array<u32, i32(8)>;

fn share_streams_0( end_0 : u32)
{
    load_tables_0();
    var _S5 : u32 = min(stream_total_0, u32(8));
    stream_total_0 = _S5;
    stream_end_0 = min(end_0, _S5);
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
        shared_stream_0[s_0] = (((((((((shape_0 >> (u32(8)))) & (u32(7)))) | (((((((shape_0 >> (u32(16)))) & (u32(63)))) << (u32(3))))))) | (((((((shape_0 >> (u32(24)))) & (u32(7)))) << (u32(9))))))) | ((((min(element_0, u32(20))) << (u32(12))))));
        shared_bases_0[s_0] = load_word_0(u32(9) + _S6);
        s_0 = s_0 + u32(32);
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
    var _S7 : u32 = (extractBits((shared_stream_0[s_1]), u32((i32(0))), u32((i32(3)))));
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
    var _S9 : u32 = (extractBits((shared_stream_0[s_2]), u32((i32(0))), u32((i32(3)))));
    return ((_S8 * _S9 + u32(31)) >> (u32(5)));
}

var<workgroup> shared_places_0 : array<u32, i32(8)>;

fn share_value_places_0()
{
    var s_3 : u32 = the_thread_0;
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
        shared_places_0[s_3] = (_S13 | (((_S14 << (u32(22))))));
        s_3 = s_3 + u32(32);
    }
    workgroupBarrier();
    return;
}

fn job_values_0() -> u32
{
    return push_0.value_words_0 * (job_place_0 - push_0.first_0);
}

var<private> the_values_0 : u32;

fn job_triangles_0() -> u32
{
    return u32(64) * job_place_0;
}

var<private> team_triangles_0 : u32;

struct Connected_0
{
     boundary_0 : vec2<u32>,
     starts_0 : vec2<u32>,
     closing_0 : vec2<u32>,
     ends_0 : vec2<u32>,
     splits_0 : vec2<u32>,
     references_0 : vec2<u32>,
};

var<private> connected_0 : Connected_0;

var<private> symbol_c_0 : vec2<u32>;

var<private> symbol_e_0 : vec2<u32>;

var<private> symbol_s_0 : vec2<u32>;

var<private> triangle_count_0 : u32;

var<private> vertex_count_0 : u32;

var<private> team_boundary_0 : vec2<u32>;

var<private> error_0 : u32;

var<workgroup> team_begins_0 : array<atomic<u32>, i32(17)>;

var<workgroup> team_loop_0 : array<atomic<u32>, i32(16)>;

var<workgroup> team_error_0 : atomic<u32>;

var<workgroup> team_symbols_0 : array<vec2<u32>, i32(4)>;

fn mask_none_0() -> vec2<u32>
{
    return vec2<u32>(u32(0));
}

var<workgroup> team_ranks_0 : vec2<u32>;

var<workgroup> team_waiting_0 : vec2<u32>;

fn open_team_0()
{
    error_0 = u32(0);
    var i_3 : u32 = the_thread_0;
    for(;;)
    {
        if(i_3 < u32(17))
        {
        }
        else
        {
            break;
        }
        atomicStore(&(team_begins_0[i_3]), u32(0));
        atomicStore(&(team_loop_0[(i_3 & (u32(15)))]), u32(0));
        i_3 = i_3 + u32(32);
    }
    if(the_thread_0 == u32(0))
    {
        atomicStore(&(team_error_0), u32(0));
        i_3 = u32(0);
        for(;;)
        {
            if(i_3 < u32(4))
            {
            }
            else
            {
                break;
            }
            team_symbols_0[i_3] = mask_none_0();
            i_3 = i_3 + u32(1);
        }
        var _S15 : vec2<u32> = mask_none_0();
        team_ranks_0 = _S15;
        team_waiting_0 = _S15;
    }
    workgroupBarrier();
    return;
}

var<workgroup> team_seam_refs_0 : array<vec2<u32>, i32(8)>;

fn word_below_0( n_0 : u32) -> u32
{
    var _S16 : u32;
    if(n_0 >= u32(32))
    {
        _S16 = u32(4294967295);
    }
    else
    {
        _S16 = ((u32(1) << (n_0))) - u32(1);
    }
    return _S16;
}

fn mask_below_0( n_1 : u32) -> vec2<u32>
{
    var _S17 : u32 = word_below_0(n_1);
    var _S18 : u32;
    if(n_1 <= u32(32))
    {
        _S18 = u32(0);
    }
    else
    {
        _S18 = word_below_0(n_1 - u32(32));
    }
    return vec2<u32>(_S17, _S18);
}

fn mask_any_0( m_0 : vec2<u32>) -> bool
{
    return (((m_0.x) | ((m_0.y)))) != u32(0);
}

var<private> team_codes_begin_0 : u32;

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
        var _S19 : u32 = (extractBits((shared_stream_0[s_4]), u32((i32(0))), u32((i32(3)))));
        (*p_1) = (*p_1) + u32(5) * _S19;
        return u32(255);
    }
    var base_1 : u32;
    if(of_chains_0)
    {
        var _S20 : u32 = (extractBits((shared_bases_0[s_4]), u32((i32(0))), u32((i32(5)))));
        base_1 = _S20;
    }
    else
    {
        var _S21 : u32 = (extractBits((shared_bases_0[s_4]), u32((i32(8))), u32((i32(5)))));
        base_1 = _S21;
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
    var _S22 : u32 = (k_0 & (u32(31)));
    if(rice_0)
    {
        base_1 = u32(0);
    }
    else
    {
        base_1 = u32(32);
    }
    return (_S22 | (base_1));
}

var<workgroup> team_codes_0 : array<u32, i32(8)>;

fn read_interior_codes_0( p_2 : u32,  chains_1 : bool)
{
    var _S23 : u32 = p_2;
    team_codes_begin_0 = p_2;
    var s_5 : u32 = u32(0);
    for(;;)
    {
        if(s_5 < stream_total_0)
        {
        }
        else
        {
            break;
        }
        if(chains_1)
        {
            var _S24 : u32 = code_at_0(&(_S23), s_5, true);
        }
        var code_0 : u32 = code_at_0(&(_S23), s_5, false);
        var _S25 : u32 = (extractBits((shared_stream_0[s_5]), u32((i32(0))), u32((i32(3)))));
        var widths_0 : u32 = _S23 - u32(5) * _S25 - team_codes_begin_0;
        if(the_thread_0 == u32(0))
        {
            team_codes_0[s_5] = (code_0 | (((widths_0 << (u32(8))))));
        }
        s_5 = s_5 + u32(1);
    }
    return;
}

var<workgroup> team_interior_0 : u32;

fn meshlet_start_0( m_1 : u32) -> u32
{
    var group_0 : u32 = group_table_0 + u32(3) * (m_1 / u32(32));
    var base_2 : u32 = load_word_0(group_0);
    var line_0 : u32 = load_word_0(group_0 + u32(1));
    var width_0 : u32 = ((load_word_0(group_0 + u32(2))) & (u32(31)));
    var i_5 : u32 = m_1 % u32(32);
    var rest_0 : u32 = meshlet_total_0 - (m_1 - i_5);
    var count_0 : u32;
    if(rest_0 < u32(32))
    {
        count_0 = rest_0;
    }
    else
    {
        count_0 = u32(32);
    }
    return base_2 + (((count_0 * width_0 + u32(7)) >> (u32(3)))) + ((line_0 & (u32(65535)))) * i_5 - ((line_0 >> (u32(16)))) + load_bits_0(u32(8) * base_2 + i_5 * width_0, width_0);
}

fn load_words3_0( i_6 : u32) -> vec3<u32>
{
    return vec3<u32>(load_memory_0(i_6), load_memory_0(i_6 + u32(1)), load_memory_0(i_6 + u32(2)));
}

fn load_mask_0( p_3 : u32,  n_3 : u32) -> vec2<u32>
{
    var words_3 : vec3<u32> = load_words3_0((p_3 >> (u32(5))));
    var _S26 : u32 = words_3.y;
    var _S27 : u32 = (p_3 & (u32(31)));
    return (vec2<u32>(funnel_0(words_3.x, _S26, _S27), funnel_0(_S26, words_3.z, _S27)) & ((mask_below_0(n_3))));
}

fn mask_count_0( m_2 : vec2<u32>) -> u32
{
    return countOneBits(m_2.x) + countOneBits(m_2.y);
}

struct Planes_0
{
     p0_0 : vec2<u32>,
     p1_0 : vec2<u32>,
     p2_0 : vec2<u32>,
     p3_0 : vec2<u32>,
     end_1 : u32,
};

fn load_planes_0( begin_0 : u32,  triangles_0 : u32) -> Planes_0
{
    var count_1 : u32 = triangles_0 - u32(1);
    var planes_0 : Planes_0;
    var _S28 : vec2<u32> = load_mask_0(begin_0, count_1);
    planes_0.p0_0 = _S28;
    var p_4 : u32 = begin_0 + count_1;
    var count_2 : u32 = mask_count_0(_S28);
    var _S29 : vec2<u32> = load_mask_0(p_4, count_2);
    planes_0.p1_0 = _S29;
    var p_5 : u32 = p_4 + count_2;
    var count_3 : u32 = mask_count_0(_S29);
    var _S30 : vec2<u32> = load_mask_0(p_5, count_3);
    planes_0.p2_0 = _S30;
    var p_6 : u32 = p_5 + count_3;
    var count_4 : u32 = mask_count_0(_S30);
    planes_0.p3_0 = load_mask_0(p_6, count_4);
    planes_0.end_1 = p_6 + count_4;
    return planes_0;
}

fn mask_bit_0( i_7 : u32) -> vec2<u32>
{
    var _S31 : vec2<u32>;
    if(((i_7 & (u32(32)))) == u32(0))
    {
        _S31 = vec2<u32>((u32(1) << (((i_7 & (u32(31)))))), u32(0));
    }
    else
    {
        _S31 = vec2<u32>(u32(0), (u32(1) << (((i_7 & (u32(31)))))));
    }
    return _S31;
}

fn mask_test_0( m_3 : vec2<u32>,  i_8 : u32) -> bool
{
    var _S32 : u32;
    if(((i_8 & (u32(32)))) == u32(0))
    {
        _S32 = m_3.x;
    }
    else
    {
        _S32 = m_3.y;
    }
    return ((((_S32 >> (((i_8 & (u32(31))))))) & (u32(1)))) != u32(0);
}

fn mask_shl1_0( m_4 : vec2<u32>) -> vec2<u32>
{
    var _S33 : u32 = m_4.x;
    return vec2<u32>((_S33 << (u32(1))), ((((m_4.y) << (u32(1)))) | (((_S33 >> (u32(31)))))));
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
    var _S34 : bool;
    if(m_5 >= meshlet_total_0)
    {
        _S34 = true;
    }
    else
    {
        _S34 = start_0 >= (byte_length_0 - u32(8));
    }
    var start_1 : u32;
    if(_S34)
    {
        error_0 = u32(1);
        start_1 = u32(0);
    }
    else
    {
        start_1 = start_0;
    }
    var p_7 : u32 = u32(8) * start_1;
    var bits_1 : u32 = load_bits_0(p_7, u32(16));
    var reference_width_0 : u32 = (((fields_0 >> (u32(13)))) & (u32(7)));
    h_0.meshlet_0 = m_5;
    h_0.triangles_1 = ((bits_1 & (u32(63)))) + u32(1);
    h_0.references_1 = (((((bits_1 >> (u32(6)))) & ((((u32(1) << (reference_width_0))) - u32(1))))) & (u32(63)));
    var _S35 : u32 = u32(6) + reference_width_0;
    var _S36 : u32 = (bits_1 >> (_S35));
    var p_8 : u32 = p_7 + _S35;
    h_0.flags_0 = u32(0);
    var bits_2 : u32 = _S36;
    var flag_0 : u32 = u32(1);
    var p_9 : u32 = p_8;
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
            var _S37 : u32 = p_9 + u32(1);
            bits_2 = (bits_2 >> (u32(1)));
            p_9 = _S37;
        }
        flag_0 = flag_0 + flag_0;
    }
    h_0.delta_width_0 = (((fields_0 >> (u32(5)))) & (u32(31)));
    h_0.slot_width_0 = (((fields_0 >> (u32(10)))) & (u32(7)));
    h_0.table_0 = (((fields_0 >> (u32(19)))) & (u32(1)));
    h_0.begin_1 = p_9;
    var _S38 : Planes_0 = load_planes_0(p_9, h_0.triangles_1);
    var r_0 : u32 = h_0.references_1;
    var all_0 : vec2<u32> = mask_below_0(h_0.references_1);
    var _S39 : vec2<u32> = mask_none_0();
    h_0.foreign_refs_1 = _S39;
    h_0.private_refs_1 = _S39;
    h_0.loop_ends_2 = _S39;
    h_0.length_width_0 = u32(0);
    if((h_0.references_1) == u32(0))
    {
        _S34 = (h_0.flags_0) != u32(0);
    }
    else
    {
        _S34 = false;
    }
    if(_S34)
    {
        error_0 = u32(4);
    }
    if(r_0 > u32(0))
    {
        h_0.foreign_refs_1 = load_mask_0(_S38.end_1, r_0);
        var p_10 : u32 = _S38.end_1 + r_0;
        var _S40 : u32 = r_0 - u32(1);
        h_0.loop_ends_2 = mask_bit_0(_S40);
        if((((h_0.flags_0) & (u32(1)))) != u32(0))
        {
            var _S41 : vec2<u32> = load_mask_0(p_10, r_0);
            h_0.loop_ends_2 = _S41;
            var p_11 : u32 = p_10 + r_0;
            if(!mask_test_0(_S41, _S40))
            {
                error_0 = u32(4);
            }
            p_9 = p_11;
        }
        else
        {
            p_9 = p_10;
        }
        if((((h_0.flags_0) & (u32(2)))) != u32(0))
        {
            var _S42 : vec2<u32> = load_mask_0(p_9, r_0);
            h_0.private_refs_1 = _S42;
            var p_12 : u32 = p_9 + r_0;
            if(mask_any_0((_S42 & ((h_0.foreign_refs_1)))))
            {
                error_0 = u32(4);
            }
            p_9 = p_12;
        }
        var _S43 : u32 = load_bits_0(p_9, u32(3));
        h_0.length_width_0 = _S43;
        var p_13 : u32 = p_9 + u32(3);
        if(_S43 > u32(6))
        {
            error_0 = u32(4);
        }
        p_9 = p_13;
    }
    else
    {
        p_9 = _S38.end_1;
    }
    var _S44 : vec2<u32> = (all_0 & ((~(((h_0.foreign_refs_1) | ((h_0.private_refs_1)))))));
    h_0.owned_refs_0 = _S44;
    var _S45 : vec2<u32> = (_S44 | ((((h_0.private_refs_1) & ((~lone_references_0(h_0.loop_ends_2)))))));
    h_0.sized_refs_0 = _S45;
    h_0.lengths_1 = p_9;
    var p_14 : u32 = p_9 + h_0.length_width_0 * mask_count_0(_S45);
    h_0.entries_1 = p_14;
    var _S46 : u32 = h_0.delta_width_0 + h_0.slot_width_0;
    if((((h_0.flags_0) & (u32(4)))) != u32(0))
    {
        start_1 = stream_total_0 - u32(1);
    }
    else
    {
        start_1 = u32(0);
    }
    var _S47 : u32 = _S46 + start_1;
    h_0.entry_width_0 = _S47;
    h_0.codes_1 = p_14 + _S47 * mask_count_0(h_0.foreign_refs_1);
    return h_0;
}

fn connectivity_starts_0() -> vec2<u32>
{
    return connected_0.starts_0;
}

fn connectivity_boundary_0() -> vec2<u32>
{
    return connected_0.boundary_0;
}

var<private> team_disks_0 : u32;

fn pushed_vertices_0( some_0 : vec2<u32>) -> u32
{
    return mask_count_0((some_0 & ((~((symbol_c_0 | (symbol_s_0))))))) + mask_count_0((some_0 & (symbol_e_0)));
}

fn find_disks_0()
{
    var ids_0 : u32;
    var starts_1 : vec2<u32> = connectivity_starts_0();
    team_boundary_0 = connectivity_boundary_0();
    var _S48 : u32 = mask_count_0(starts_1);
    team_disks_0 = _S48;
    var _S49 : u32 = pushed_vertices_0(mask_below_0(triangle_count_0)) + _S48;
    vertex_count_0 = _S49;
    var _S50 : bool;
    if(_S49 > u32(64))
    {
        _S50 = true;
    }
    else
    {
        _S50 = team_disks_0 == u32(0);
    }
    if(_S50)
    {
        error_0 = u32(3);
        vertex_count_0 = min(vertex_count_0, u32(64));
    }
    var t_0 : u32 = the_thread_0;
    for(;;)
    {
        if(t_0 <= triangle_count_0)
        {
        }
        else
        {
            break;
        }
        if(t_0 < triangle_count_0)
        {
            _S50 = !mask_test_0(starts_1, t_0);
        }
        else
        {
            _S50 = false;
        }
        if(_S50)
        {
            t_0 = t_0 + u32(32);
            continue;
        }
        var before_2 : vec2<u32> = mask_below_0(t_0);
        var disk_0 : u32 = mask_count_0((starts_1 & (before_2)));
        var _S51 : u32 = pushed_vertices_0(before_2) + disk_0;
        if(t_0 == triangle_count_0)
        {
            ids_0 = vertex_count_0;
        }
        else
        {
            ids_0 = _S51;
        }
        var _S52 : u32 = atomicOr(&(team_begins_0[(disk_0 >> (u32(2)))]), ((min(ids_0, u32(64))) << ((u32(8) * ((disk_0 & (u32(3))))))));
        t_0 = t_0 + u32(32);
    }
    ids_0 = the_thread_0;
    for(;;)
    {
        if(ids_0 < vertex_count_0)
        {
        }
        else
        {
            break;
        }
        if(!mask_test_0(team_boundary_0, ids_0))
        {
            ids_0 = ids_0 + u32(32);
            continue;
        }
        var rank_0 : u32 = mask_count_0((team_boundary_0 & ((mask_below_0(ids_0)))));
        var _S53 : u32 = atomicOr(&(team_loop_0[(rank_0 >> (u32(2)))]), (ids_0 << ((u32(8) * ((rank_0 & (u32(3))))))));
        ids_0 = ids_0 + u32(32);
    }
    return;
}

fn mask_lsb_0( m_6 : vec2<u32>) -> u32
{
    var _S54 : u32 = m_6.x;
    var _S55 : u32;
    if(_S54 != u32(0))
    {
        _S55 = firstbitlow_0(_S54);
    }
    else
    {
        var _S56 : u32 = m_6.y;
        if(_S56 != u32(0))
        {
            _S55 = u32(32) + firstbitlow_0(_S56);
        }
        else
        {
            _S55 = u32(64);
        }
    }
    return _S55;
}

var<workgroup> team_references_0 : array<u32, i32(64)>;

fn place_team_references_0()
{
    var _S57 : u32 = mask_count_0(team_boundary_0);
    var rank_1 : u32 = the_thread_0;
    for(;;)
    {
        if(rank_1 < _S57)
        {
        }
        else
        {
            break;
        }
        if(!mask_test_0(connected_0.references_0, rank_1))
        {
            rank_1 = rank_1 + u32(32);
            continue;
        }
        var r_1 : u32 = mask_count_0(((connected_0.references_0) & ((mask_below_0(rank_1)))));
        var later_0 : vec2<u32> = ((connected_0.references_0) & ((~mask_below_0(rank_1 + u32(1)))));
        var _S58 : u32;
        if(mask_any_0(later_0))
        {
            _S58 = mask_lsb_0(later_0);
        }
        else
        {
            _S58 = _S57;
        }
        team_references_0[(r_1 & (u32(63)))] = (rank_1 | ((((_S58 - rank_1) << (u32(8))))));
        rank_1 = rank_1 + u32(32);
    }
    if(the_thread_0 == u32(0))
    {
        team_ranks_0 = connected_0.references_0;
    }
    return;
}

fn mask_clear_lsb_0( m_7 : vec2<u32>) -> vec2<u32>
{
    var _S59 : u32 = m_7.x;
    var _S60 : vec2<u32>;
    if(_S59 != u32(0))
    {
        _S60 = vec2<u32>((_S59 & ((_S59 - u32(1)))), m_7.y);
    }
    else
    {
        var _S61 : u32 = m_7.y;
        _S60 = vec2<u32>(u32(0), (_S61 & ((_S61 - u32(1)))));
    }
    return _S60;
}

fn seam_references_0( h_1 : Header_0,  s_6 : u32) -> vec2<u32>
{
    var seams_0 : vec2<u32> = mask_none_0();
    var _S62 : bool;
    if(s_6 == u32(0))
    {
        _S62 = true;
    }
    else
    {
        _S62 = (((h_1.flags_0) & (u32(4)))) == u32(0);
    }
    if(_S62)
    {
        return seams_0;
    }
    var _S63 : u32 = h_1.entries_1 + h_1.delta_width_0 + h_1.slot_width_0 + s_6 - u32(1);
    var rest_1 : vec2<u32> = h_1.foreign_refs_1;
    var seams_1 : vec2<u32> = seams_0;
    var share_0 : u32 = _S63;
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
        var share_1 : u32 = share_0 + h_1.entry_width_0;
        rest_1 = mask_clear_lsb_0(rest_1);
        share_0 = share_1;
    }
    return seams_1;
}

fn find_seams_of_0() -> Header_0
{
    var h_2 : Header_0 = read_header_0(job_meshlet_0);
    find_disks_0();
    place_team_references_0();
    var s_7 : u32 = the_thread_0;
    for(;;)
    {
        if(s_7 < stream_total_0)
        {
        }
        else
        {
            break;
        }
        team_seam_refs_0[s_7] = seam_references_0(h_2, s_7);
        s_7 = s_7 + u32(32);
    }
    workgroupBarrier();
    return h_2;
}

fn packed_triangle_0( t_1 : u32) -> u32
{
    return all_triangles_0[team_triangles_0 + ((t_1 & (u32(63))))];
}

var<private> traversed_count_0 : u32;

var<workgroup> team_traversal_0 : array<u32, i32(64)>;

fn pack4_0( x_0 : u32,  y_0 : u32,  z_0 : u32,  w_0 : u32) -> u32
{
    return (((((x_0 | (((y_0 << (u32(8))))))) | (((z_0 << (u32(16))))))) | (((w_0 << (u32(24))))));
}

fn list_traversal_0()
{
    var waiting_1 : vec2<u32> = team_waiting_0;
    var starts_2 : vec2<u32> = connectivity_starts_0();
    var _S64 : vec2<u32> = mask_none_0();
    var _S65 : vec2<u32> = symbol_c_0;
    var roots_0 : vec2<u32>;
    var introducing_0 : vec2<u32>;
    var t_2 : u32;
    if(mask_any_0(team_waiting_0))
    {
        var rest_2 : vec2<u32> = starts_2;
        var waiting_2 : vec2<u32> = waiting_1;
        roots_0 = _S64;
        for(;;)
        {
            if(mask_any_0(rest_2))
            {
            }
            else
            {
                break;
            }
            var t_3 : u32 = mask_lsb_0(rest_2);
            var a_0 : u32 = ((packed_triangle_0(t_3)) & (u32(63)));
            if(!mask_test_0(waiting_2, a_0))
            {
                rest_2 = mask_clear_lsb_0(rest_2);
                continue;
            }
            var _S66 : vec2<u32> = (roots_0 | ((mask_bit_0(t_3))));
            waiting_2 = (waiting_2 & ((~mask_bit_0(a_0))));
            roots_0 = _S66;
            rest_2 = mask_clear_lsb_0(rest_2);
        }
        introducing_0 = _S65;
        t_2 = u32(0);
        for(;;)
        {
            var _S67 : bool;
            if(t_2 < triangle_count_0)
            {
                _S67 = mask_any_0(waiting_2);
            }
            else
            {
                _S67 = false;
            }
            if(_S67)
            {
            }
            else
            {
                break;
            }
            var v_0 : u32 = ((((packed_triangle_0(t_2)) >> (u32(16)))) & (u32(63)));
            if(!mask_test_0(waiting_2, v_0))
            {
                t_2 = t_2 + u32(1);
                continue;
            }
            var _S68 : vec2<u32> = (introducing_0 | ((mask_bit_0(t_2))));
            waiting_2 = (waiting_2 & ((~mask_bit_0(v_0))));
            introducing_0 = _S68;
            t_2 = t_2 + u32(1);
        }
        if(mask_any_0(waiting_2))
        {
            error_0 = u32(2);
        }
    }
    else
    {
        introducing_0 = _S65;
        roots_0 = _S64;
    }
    var _S69 : u32 = mask_count_0(introducing_0) + mask_count_0(roots_0);
    traversed_count_0 = _S69;
    if(_S69 > u32(64))
    {
        error_0 = u32(2);
        traversed_count_0 = u32(0);
    }
    t_2 = the_thread_0;
    for(;;)
    {
        if(t_2 < triangle_count_0)
        {
        }
        else
        {
            break;
        }
        if(!mask_test_0((introducing_0 | (roots_0)), t_2))
        {
            t_2 = t_2 + u32(32);
            continue;
        }
        var _S70 : vec2<u32> = mask_below_0(t_2);
        var place_0 : u32 = mask_count_0((introducing_0 & (_S70))) + mask_count_0((roots_0 & (_S70)));
        var triangle_0 : u32 = packed_triangle_0(t_2);
        var place_1 : u32;
        if(mask_test_0(roots_0, t_2))
        {
            var b_0 : u32 = (((triangle_0 >> (u32(8)))) & (u32(255)));
            team_traversal_0[(place_0 & (u32(63)))] = pack4_0(b_0, b_0, (triangle_0 & (u32(255))), b_0);
            place_1 = place_0 + u32(1);
        }
        else
        {
            place_1 = place_0;
        }
        if(mask_test_0(introducing_0, t_2))
        {
            team_traversal_0[(place_1 & (u32(63)))] = triangle_0;
        }
        t_2 = t_2 + u32(32);
    }
    return;
}

fn is_packed_0( s_8 : u32) -> bool
{
    var _S71 : u32 = (extractBits((shared_places_0[s_8]), u32((i32(16))), u32((i32(6)))));
    return _S71 <= u32(2);
}

fn word_of_0( s_9 : u32,  id_0 : u32) -> u32
{
    var _S72 : u32 = (extractBits((shared_places_0[s_9]), u32((i32(0))), u32((i32(16)))));
    var _S73 : u32 = (extractBits((shared_places_0[s_9]), u32((i32(16))), u32((i32(6)))));
    return _S72 + _S73 * ((id_0 & (u32(63))));
}

fn vertex_at_0( s_10 : u32,  id_1 : u32) -> vec2<u32>
{
    var word_1 : u32 = word_of_0(s_10, id_1);
    var _S74 : u32 = (extractBits((shared_places_0[s_10]), u32((i32(16))), u32((i32(6)))));
    if(_S74 == u32(1))
    {
        return vec2<u32>(all_values_0[the_values_0 + word_1], u32(0));
    }
    var _S75 : u32 = u32(2) * ((word_1 >> (u32(1))));
    return vec2<u32>(all_values_0[the_values_0 + _S75], all_values_0[the_values_0 + _S75 + u32(1)]);
}

fn value_element_0( s_11 : u32,  c_0 : u32) -> u32
{
    var _S76 : u32 = (extractBits((shared_stream_0[s_11]), u32((i32(12))), u32((i32(11)))));
    var element_2 : u32 = _S76 + c_0;
    var _S77 : u32;
    if(element_2 < u32(20))
    {
        _S77 = element_2;
    }
    else
    {
        _S77 = u32(0);
    }
    return _S77 * u32(64);
}

var<workgroup> team_values_0 : array<u32, i32(1280)>;

fn get_field_0( fields_1 : vec2<u32>,  at_0 : u32,  bits_3 : u32) -> u32
{
    var value_2 : u32;
    if(at_0 < u32(32))
    {
        value_2 = ((((fields_1.x) >> (at_0))) | ((((((fields_1.y) << (u32(1)))) << ((u32(31) - at_0))))));
    }
    else
    {
        value_2 = ((fields_1.y) >> ((at_0 - u32(32))));
    }
    return (value_2 & ((word_below_0(bits_3))));
}

fn value_at_0( s_12 : u32,  c_1 : u32,  id_2 : u32) -> u32
{
    var _S78 : bool = is_packed_0(s_12);
    if(_S78)
    {
        var _S79 : vec2<u32> = vertex_at_0(s_12, id_2);
        var _S80 : u32 = (extractBits((shared_places_0[s_12]), u32((i32(22))), u32((i32(6)))));
        var _S81 : u32 = c_1 * _S80;
        var _S82 : u32 = (extractBits((shared_places_0[s_12]), u32((i32(22))), u32((i32(6)))));
        return get_field_0(_S79, _S81, _S82);
    }
    var _S83 : u32 = the_values_0;
    var _S84 : u32 = word_of_0(s_12, id_2);
    return all_values_0[_S83 + (_S84 + c_1)];
}

fn load_boundary_0()
{
    var id_3 : u32 = the_thread_0;
    for(;;)
    {
        if(id_3 < vertex_count_0)
        {
        }
        else
        {
            break;
        }
        if(!mask_test_0(team_boundary_0, id_3))
        {
            id_3 = id_3 + u32(32);
            continue;
        }
        var s_13 : u32 = u32(0);
        for(;;)
        {
            if(s_13 < stream_end_0)
            {
            }
            else
            {
                break;
            }
            var _S85 : bool = is_packed_0(s_13);
            var _S86 : vec2<u32>;
            if(_S85)
            {
                var _S87 : vec2<u32> = vertex_at_0(s_13, id_3);
                _S86 = _S87;
            }
            else
            {
                _S86 = vec2<u32>(u32(0));
            }
            var _S88 : u32 = (extractBits((shared_places_0[s_13]), u32((i32(22))), u32((i32(6)))));
            var c_2 : u32 = u32(0);
            for(;;)
            {
                var _S89 : u32 = (extractBits((shared_stream_0[s_13]), u32((i32(0))), u32((i32(3)))));
                if(c_2 < _S89)
                {
                }
                else
                {
                    break;
                }
                var _S90 : u32 = value_element_0(s_13, c_2);
                var _S91 : bool = is_packed_0(s_13);
                var _S92 : u32;
                if(_S91)
                {
                    _S92 = get_field_0(_S86, c_2 * _S88, _S88);
                }
                else
                {
                    var _S93 : u32 = value_at_0(s_13, c_2, id_3);
                    _S92 = _S93;
                }
                team_values_0[_S90 + id_3] = _S92;
                c_2 = c_2 + u32(1);
            }
            s_13 = s_13 + u32(1);
        }
        id_3 = id_3 + u32(32);
    }
    return;
}

fn listed_streams_0( s_14 : u32,  end_2 : u32) -> u32
{
    var next_0 : u32 = s_14;
    var elements_0 : u32 = u32(0);
    for(;;)
    {
        if(next_0 < end_2)
        {
        }
        else
        {
            break;
        }
        var elements_1 : u32 = elements_0 + ((((the_blob_0[u32(8) + u32(7) * next_0] >> (u32(8)))) & (u32(7))));
        var _S94 : bool;
        if(next_0 > s_14)
        {
            _S94 = elements_1 > u32(4);
        }
        else
        {
            _S94 = false;
        }
        if(_S94)
        {
            break;
        }
        next_0 = next_0 + u32(1);
        elements_0 = elements_1;
    }
    return next_0;
}

fn interior_code_of_0( s_15 : u32) -> u32
{
    return ((team_codes_0[s_15]) & (u32(255)));
}

fn reference_length_of_0( r_2 : u32) -> u32
{
    return ((team_references_0[(r_2 & (u32(63)))]) >> (u32(8)));
}

fn seam_vertices_of_0( s_16 : u32) -> u32
{
    var rest_3 : vec2<u32> = team_seam_refs_0[s_16];
    var count_5 : u32 = u32(0);
    for(;;)
    {
        if(mask_any_0(rest_3))
        {
        }
        else
        {
            break;
        }
        var count_6 : u32 = count_5 + (reference_length_of_0(mask_lsb_0(rest_3)) - u32(1));
        rest_3 = mask_clear_lsb_0(rest_3);
        count_5 = count_6;
    }
    return count_5;
}

fn interior_ones_0( begin_2 : u32,  end_3 : u32) -> u32
{
    var s_17 : u32 = begin_2;
    var ones_0 : u32 = u32(0);
    for(;;)
    {
        if(s_17 < end_3)
        {
        }
        else
        {
            break;
        }
        if((interior_code_of_0(s_17)) != u32(255))
        {
            var _S95 : u32 = traversed_count_0 + seam_vertices_of_0(s_17);
            var _S96 : u32 = (extractBits((shared_stream_0[s_17]), u32((i32(0))), u32((i32(3)))));
            ones_0 = ones_0 + _S95 * _S96;
        }
        s_17 = s_17 + u32(1);
    }
    return ones_0;
}

var<workgroup> team_scratch_0 : array<atomic<u32>, i32(256)>;

fn list_ones_0( p_15 : u32,  n_4 : u32)
{
    var word_2 : u32;
    var before_3 : u32;
    var _S97 : u32 = (p_15 >> (u32(5)));
    var empty_0 : u32 = u32(0);
    var found_0 : u32 = u32(0);
    var w_1 : u32 = _S97;
    for(;;)
    {
        if(found_0 < n_4)
        {
        }
        else
        {
            break;
        }
        var k_1 : u32 = u32(0);
        var found_1 : u32 = found_0;
        var mine_0 : u32 = u32(0);
        var before_4 : u32 = found_0;
        for(;;)
        {
            var _S98 : bool;
            if(k_1 < u32(32))
            {
                _S98 = found_1 < n_4;
            }
            else
            {
                _S98 = false;
            }
            if(_S98)
            {
            }
            else
            {
                break;
            }
            var _S99 : u32 = w_1 + k_1;
            var word_3 : u32 = load_word_0(_S99);
            if(_S99 == _S97)
            {
                word_2 = (word_3 & ((~word_below_0((p_15 & (u32(31)))))));
            }
            else
            {
                word_2 = word_3;
            }
            if(k_1 == the_thread_0)
            {
                mine_0 = word_2;
                before_4 = found_1;
            }
            if(word_2 == u32(0))
            {
                before_3 = empty_0 + u32(1);
            }
            else
            {
                before_3 = u32(0);
            }
            var found_2 : u32 = found_1 + countOneBits(word_2);
            var _S100 : u32 = k_1 + u32(1);
            empty_0 = before_3;
            k_1 = _S100;
            found_1 = found_2;
        }
        var _S101 : bool;
        if(w_1 >= (push_0.blob_words_0))
        {
            _S101 = true;
        }
        else
        {
            _S101 = empty_0 > u32(543);
        }
        if(_S101)
        {
            error_0 = u32(8);
            return;
        }
        word_2 = mine_0;
        before_3 = before_4;
        for(;;)
        {
            var _S102 : bool;
            if(word_2 != u32(0))
            {
                _S102 = before_3 < n_4;
            }
            else
            {
                _S102 = false;
            }
            if(_S102)
            {
            }
            else
            {
                break;
            }
            atomicStore(&(team_scratch_0[before_3]), (((w_1 + the_thread_0) << (u32(5)))) + firstbitlow_0(word_2));
            var mine_1 : u32 = (word_2 & ((word_2 - u32(1))));
            var _S103 : u32 = before_3 + u32(1);
            word_2 = mine_1;
            before_3 = _S103;
        }
        var w_2 : u32 = w_1 + u32(32);
        found_0 = found_1;
        w_1 = w_2;
    }
    return;
}

fn after_ones_0( p_16 : u32,  n_5 : u32) -> u32
{
    if(n_5 == u32(0))
    {
        return p_16;
    }
    var w_3 : u32 = (p_16 >> (u32(5)));
    var word_4 : u32 = ((load_word_0(w_3)) & ((~word_below_0((p_16 & (u32(31)))))));
    var ones_1 : u32 = countOneBits(word_4);
    var empty_1 : u32 = u32(0);
    var _S104 : u32 = n_5;
    var w_4 : u32 = w_3;
    var word_5 : u32 = word_4;
    for(;;)
    {
        if(ones_1 < _S104)
        {
        }
        else
        {
            break;
        }
        if(ones_1 == u32(0))
        {
            empty_1 = empty_1 + u32(1);
        }
        else
        {
            empty_1 = u32(0);
        }
        var _S105 : bool;
        if(w_4 >= (push_0.blob_words_0))
        {
            _S105 = true;
        }
        else
        {
            _S105 = empty_1 > u32(512);
        }
        if(_S105)
        {
            error_0 = u32(8);
            return p_16;
        }
        var _S106 : u32 = _S104 - ones_1;
        var w_5 : u32 = w_4 + u32(1);
        var word_6 : u32 = load_word_0(w_5);
        ones_1 = countOneBits(word_6);
        _S104 = _S106;
        w_4 = w_5;
        word_5 = word_6;
    }
    ones_1 = _S104;
    for(;;)
    {
        if(ones_1 > u32(1))
        {
        }
        else
        {
            break;
        }
        var word_7 : u32 = (word_5 & ((word_5 - u32(1))));
        ones_1 = ones_1 - u32(1);
        word_5 = word_7;
    }
    return ((w_4 << (u32(5)))) + firstbitlow_0(word_5) + u32(1);
}

fn interior_widths_of_0( s_18 : u32) -> u32
{
    return team_codes_begin_0 + (((team_codes_0[s_18]) >> (u32(8))));
}

var<workgroup> team_seams_0 : array<u32, i32(64)>;

fn loop_id_0( rank_2 : u32) -> u32
{
    var _S107 : u32 = atomicLoad(&(team_loop_0[(((rank_2 >> (u32(2)))) & (u32(15)))]));
    var _S108 : u32 = (extractBits((_S107), u32((i32((rank_2 & (u32(3)))) * i32(8))), u32((i32(6)))));
    return _S108;
}

fn list_seams_0( s_19 : u32) -> u32
{
    var rest_4 : vec2<u32> = team_seam_refs_0[s_19];
    var count_7 : u32 = u32(0);
    for(;;)
    {
        if(mask_any_0(rest_4))
        {
        }
        else
        {
            break;
        }
        var r_3 : u32 = mask_lsb_0(rest_4);
        var length_0 : u32 = reference_length_of_0(r_3);
        var _S109 : u32 = ((team_references_0[r_3]) & (u32(63)));
        var i_9 : u32 = u32(1) + the_thread_0;
        for(;;)
        {
            if(i_9 < length_0)
            {
            }
            else
            {
                break;
            }
            var _S110 : u32 = loop_id_0(_S109 + i_9);
            team_seams_0[((count_7 + i_9 - u32(1)) & (u32(63)))] = (((_S110 | (((r_3 << (u32(8))))))) | (((i_9 << (u32(16))))));
            i_9 = i_9 + u32(32);
        }
        var count_8 : u32 = count_7 + (length_0 - u32(1));
        rest_4 = mask_clear_lsb_0(rest_4);
        count_7 = count_8;
    }
    return min(count_7, u32(64));
}

fn width_field_0( position_0 : u32) -> u32
{
    var w_6 : u32 = load_bits_0(position_0, u32(5));
    var _S111 : u32;
    if(w_6 == u32(31))
    {
        _S111 = u32(32);
    }
    else
    {
        _S111 = w_6;
    }
    return _S111;
}

fn fixed_width_0( elements_2 : u32,  widths_1 : u32) -> u32
{
    var c_3 : u32 = u32(0);
    var sum_0 : u32 = u32(0);
    for(;;)
    {
        if(c_3 < elements_2)
        {
        }
        else
        {
            break;
        }
        var sum_1 : u32 = sum_0 + width_field_0(widths_1 + u32(5) * c_3);
        c_3 = c_3 + u32(1);
        sum_0 = sum_1;
    }
    return sum_0;
}

fn is_exponential_0( code_1 : u32) -> bool
{
    return ((code_1 & (u32(4294967264)))) == u32(32);
}

fn exponential_quotient_0( parameter_0 : u32,  q_0 : u32) -> u32
{
    var _S112 : bool;
    if(q_0 <= u32(31))
    {
        _S112 = (parameter_0 + q_0) <= u32(32);
    }
    else
    {
        _S112 = false;
    }
    if(_S112)
    {
        return q_0;
    }
    error_0 = u32(7);
    return u32(0);
}

fn coded_value_0( code_2 : u32,  q_1 : u32,  low_1 : ptr<function, u32>) -> u32
{
    var k_2 : u32 = (code_2 & (u32(31)));
    var exponential_0 : bool = ((code_2 & (u32(32)))) != u32(0);
    var _S113 : u32;
    if(exponential_0)
    {
        var _S114 : u32 = exponential_quotient_0(k_2, q_1);
        _S113 = _S114;
    }
    else
    {
        _S113 = q_1;
    }
    var width_1 : u32;
    if(exponential_0)
    {
        width_1 = k_2 + _S113;
    }
    else
    {
        width_1 = k_2;
    }
    var bits_4 : u32 = load_bits_0((*low_1), width_1);
    (*low_1) = (*low_1) + width_1;
    if(exponential_0)
    {
        _S113 = ((u32(1) << (_S113))) - u32(1);
    }
    return ((_S113 << (k_2))) + bits_4;
}

fn unzigzag_0( u_0 : u32) -> u32
{
    return (((u_0 >> (u32(1)))) ^ ((u32(0) - ((u_0 & (u32(1)))))));
}

fn read_interior_residuals_0( s_20 : u32,  code_3 : u32,  widths_2 : u32,  low_2 : u32,  seams_2 : u32,  count_9 : u32,  ones_2 : u32,  unary_begin_0 : u32)
{
    var n_6 : u32 = (extractBits((shared_stream_0[s_20]), u32((i32(0))), u32((i32(3)))));
    var _S115 : bool = code_3 == u32(255);
    var _S116 : u32;
    if(_S115)
    {
        _S116 = fixed_width_0(n_6, widths_2);
    }
    else
    {
        _S116 = u32(0);
    }
    var item_0 : u32 = the_thread_0;
    for(;;)
    {
        if(item_0 < count_9)
        {
        }
        else
        {
            break;
        }
        var i_10 : u32;
        if(n_6 == u32(3))
        {
            i_10 = ((item_0 * u32(171)) >> (u32(9)));
        }
        else
        {
            if(n_6 == u32(2))
            {
                i_10 = (item_0 >> (u32(1)));
            }
            else
            {
                var _S117 : u32 = item_0 / n_6;
                i_10 = _S117;
            }
        }
        var c_4 : u32 = item_0 - i_10 * n_6;
        var _S118 : u32;
        if(i_10 < seams_2)
        {
            _S118 = team_seams_0[(i_10 & (u32(63)))];
        }
        else
        {
            _S118 = ((team_traversal_0[((i_10 - seams_2) & (u32(63)))]) >> (u32(16)));
        }
        var id_4 : u32 = (_S118 & (u32(63)));
        var residual_0 : u32;
        if(_S115)
        {
            residual_0 = load_bits_0(low_2 + i_10 * _S116 + fixed_width_0(c_4, widths_2), width_field_0(widths_2 + u32(5) * c_4));
        }
        else
        {
            if(item_0 == u32(0))
            {
                residual_0 = unary_begin_0;
            }
            else
            {
                var _S119 : u32 = atomicLoad(&(team_scratch_0[ones_2 + item_0 - u32(1)]));
                residual_0 = _S119 + u32(1);
            }
            var _S120 : u32 = atomicLoad(&(team_scratch_0[ones_2 + item_0]));
            var quotient_0 : u32 = _S120 - residual_0;
            if(quotient_0 > u32(16383))
            {
                error_0 = u32(8);
            }
            var at_1 : u32;
            var _S121 : u32 = low_2 + item_0 * ((code_3 & (u32(31))));
            var _S122 : u32;
            if(is_exponential_0(code_3))
            {
                _S122 = residual_0 - unary_begin_0 - item_0;
            }
            else
            {
                _S122 = u32(0);
            }
            at_1 = _S121 + _S122;
            var _S123 : u32 = coded_value_0(code_3, quotient_0, &(at_1));
            residual_0 = _S123;
        }
        var _S124 : u32 = value_element_0(s_20, c_4);
        team_values_0[_S124 + id_4] = unzigzag_0(residual_0);
        item_0 = item_0 + u32(32);
    }
    return;
}

fn low_size_0( code_4 : u32,  elements_3 : u32,  widths_3 : u32,  n_7 : u32,  zeros_0 : u32) -> u32
{
    if(code_4 == u32(255))
    {
        var _S125 : u32 = n_7 / elements_3;
        return _S125 * fixed_width_0(elements_3, widths_3);
    }
    var _S126 : u32 = n_7 * ((code_4 & (u32(31))));
    var _S127 : u32;
    if(is_exponential_0(code_4))
    {
        _S127 = zeros_0;
    }
    else
    {
        _S127 = u32(0);
    }
    return _S126 + _S127;
}

fn read_interior_0( sound_0 : bool)
{
    var _S128 : bool;
    var p_17 : u32 = team_interior_0;
    var phase_0 : u32 = u32(0);
    for(;;)
    {
        var _S129 : bool;
        if(phase_0 < u32(2))
        {
            _S129 = phase_0 < (push_0.streams_0);
        }
        else
        {
            _S129 = false;
        }
        if(_S129)
        {
        }
        else
        {
            break;
        }
        var next_list_0 : u32 = phase_0;
        var p_18 : u32 = p_17;
        var ones_3 : u32 = u32(0);
        var s_21 : u32 = phase_0;
        var listed_0 : u32 = u32(0);
        var low_3 : u32 = p_17;
        for(;;)
        {
            var _S130 : bool = phase_0 == u32(0);
            var _S131 : u32;
            if(_S130)
            {
                _S131 = u32(1);
            }
            else
            {
                _S131 = push_0.streams_0;
            }
            if(s_21 < _S131)
            {
            }
            else
            {
                break;
            }
            var n_8 : u32 = (extractBits((shared_stream_0[s_21]), u32((i32(0))), u32((i32(3)))));
            workgroupBarrier();
            var listed_1 : u32;
            var seams_3 : u32;
            var low_4 : u32;
            var count_10 : u32;
            if(s_21 == next_list_0)
            {
                if(_S130)
                {
                    listed_1 = u32(1);
                }
                else
                {
                    listed_1 = push_0.streams_0;
                }
                var next_list_1 : u32 = listed_streams_0(s_21, listed_1);
                if(sound_0)
                {
                    var _S132 : u32 = interior_ones_0(s_21, next_list_1);
                    seams_3 = min(_S132, u32(256));
                }
                else
                {
                    seams_3 = u32(0);
                }
                if(sound_0)
                {
                    list_ones_0(p_18, seams_3);
                }
                workgroupBarrier();
                if(s_21 == phase_0)
                {
                    _S128 = sound_0;
                }
                else
                {
                    _S128 = false;
                }
                if(_S128)
                {
                    if(seams_3 > u32(0))
                    {
                        var _S133 : u32 = atomicLoad(&(team_scratch_0[seams_3 - u32(1)]));
                        low_4 = _S133 + u32(1);
                    }
                    else
                    {
                        low_4 = p_18;
                    }
                    if(_S130)
                    {
                        count_10 = u32(1);
                    }
                    else
                    {
                        count_10 = stream_total_0;
                    }
                    var _S134 : u32 = interior_ones_0(next_list_1, count_10);
                    var _S135 : u32 = after_ones_0(low_4, _S134);
                    low_4 = _S135;
                }
                else
                {
                    low_4 = low_3;
                }
                ones_3 = seams_3;
                next_list_0 = next_list_1;
                listed_1 = u32(0);
            }
            else
            {
                listed_1 = listed_0;
                low_4 = low_3;
            }
            var code_5 : u32 = interior_code_of_0(s_21);
            var widths_4 : u32 = interior_widths_of_0(s_21);
            if(sound_0)
            {
                var _S136 : u32 = list_seams_0(s_21);
                seams_3 = _S136;
            }
            else
            {
                seams_3 = u32(0);
            }
            if(sound_0)
            {
                _S128 = error_0 == u32(0);
            }
            else
            {
                _S128 = false;
            }
            if(_S128)
            {
                count_10 = min(seams_3 + traversed_count_0, u32(64)) * n_8;
            }
            else
            {
                count_10 = u32(0);
            }
            var _S137 : bool = code_5 != u32(255);
            var count_11 : u32;
            if(_S137)
            {
                count_11 = min(count_10, ones_3 - listed_1);
            }
            else
            {
                count_11 = count_10;
            }
            workgroupBarrier();
            read_interior_residuals_0(s_21, code_5, widths_4, low_4, seams_3, count_11, listed_1, p_18);
            var _S138 : bool;
            if(_S137)
            {
                _S138 = count_11 > u32(0);
            }
            else
            {
                _S138 = false;
            }
            var next_1 : u32;
            if(_S138)
            {
                var listed_2 : u32 = listed_1 + count_11;
                var _S139 : u32 = atomicLoad(&(team_scratch_0[listed_2 - u32(1)]));
                next_1 = _S139 + u32(1);
                listed_0 = listed_2;
            }
            else
            {
                next_1 = p_18;
                listed_0 = listed_1;
            }
            var _S140 : u32 = low_size_0(code_5, n_8, widths_4, count_11, next_1 - p_18 - count_11);
            var low_5 : u32 = low_4 + _S140;
            var _S141 : u32 = s_21 + u32(1);
            p_18 = next_1;
            s_21 = _S141;
            low_3 = low_5;
        }
        if(sound_0)
        {
            _S128 = (max(p_18, low_3)) > (u32(8) * (byte_length_0 - u32(8)));
        }
        else
        {
            _S128 = false;
        }
        if(_S128)
        {
            error_0 = u32(8);
        }
        var _S142 : u32 = phase_0 + u32(1);
        p_17 = low_3;
        phase_0 = _S142;
    }
    workgroupBarrier();
    return;
}

fn agree_0() -> bool
{
    if(error_0 != u32(0))
    {
        var _S143 : u32 = atomicMax(&(team_error_0), error_0);
    }
    workgroupBarrier();
    var _S144 : u32 = atomicLoad(&(team_error_0));
    error_0 = _S144;
    return _S144 == u32(0);
}

fn any_stream_predicts_0( predictors_0 : u32) -> bool
{
    var s_22 : u32 = u32(0);
    var found_3 : u32 = u32(0);
    for(;;)
    {
        if(s_22 < (push_0.streams_0))
        {
        }
        else
        {
            break;
        }
        var found_4 : u32 = (found_3 | (((u32(1) << (((the_blob_0[u32(8) + u32(7) * s_22] >> (u32(24)))))))));
        s_22 = s_22 + u32(1);
        found_3 = found_4;
    }
    return ((found_3 & (predictors_0))) != u32(0);
}

fn excess_0( x_1 : u32,  y_1 : u32) -> u32
{
    var _S145 : u32;
    if(x_1 > y_1)
    {
        _S145 = x_1 - y_1;
    }
    else
    {
        _S145 = u32(0);
    }
    return _S145;
}

fn geo_shift_0() -> u32
{
    var _S146 : u32 = (extractBits((shared_stream_0[u32(0)]), u32((i32(3))), u32((i32(6)))));
    return excess_0(_S146, u32(13));
}

struct Triple_0
{
     x_2 : u32,
     y_2 : u32,
     z_1 : u32,
};

fn Triple_x24init_0( x_3 : u32,  y_3 : u32,  z_2 : u32) -> Triple_0
{
    var _S147 : Triple_0;
    _S147.x_2 = x_3;
    _S147.y_2 = y_3;
    _S147.z_1 = z_2;
    return _S147;
}

fn grid_position_0( id_5 : u32) -> Triple_0
{
    return Triple_x24init_0(team_values_0[id_5], team_values_0[u32(64) + id_5], team_values_0[u32(128) + id_5]);
}

fn shift_right_0( x_4 : u32,  n_9 : u32) -> u32
{
    return u32((i32(x_4) >> (n_9)));
}

fn shifted_0( v_1 : Triple_0,  n_10 : u32) -> Triple_0
{
    var _S148 : Triple_0 = v_1;
    _S148.x_2 = shift_right_0(_S148.x_2, n_10);
    _S148.y_2 = shift_right_0(_S148.y_2, n_10);
    _S148.z_1 = shift_right_0(_S148.z_1, n_10);
    return _S148;
}

fn difference_0( to_0 : Triple_0,  from_0 : Triple_0) -> Triple_0
{
    var _S149 : Triple_0 = to_0;
    _S149.x_2 = _S149.x_2 - from_0.x_2;
    _S149.y_2 = _S149.y_2 - from_0.y_2;
    _S149.z_1 = _S149.z_1 - from_0.z_1;
    return _S149;
}

fn triangle_normal_0( triangle_1 : u32,  h_3 : u32) -> Triple_0
{
    var a_1 : Triple_0 = shifted_0(grid_position_0((triangle_1 & (u32(63)))), h_3);
    var e_0 : Triple_0 = difference_0(shifted_0(grid_position_0((((triangle_1 >> (u32(8)))) & (u32(63)))), h_3), a_1);
    var f_0 : Triple_0 = difference_0(shifted_0(grid_position_0((((triangle_1 >> (u32(16)))) & (u32(63)))), h_3), a_1);
    var n_11 : Triple_0;
    n_11.x_2 = e_0.y_2 * f_0.z_1 - e_0.z_1 * f_0.y_2;
    n_11.y_2 = e_0.z_1 * f_0.x_2 - e_0.x_2 * f_0.z_1;
    n_11.z_1 = e_0.x_2 * f_0.y_2 - e_0.y_2 * f_0.x_2;
    return n_11;
}

fn sum_team_normals_0( sound_1 : bool)
{
    var i_11 : u32 = the_thread_0;
    for(;;)
    {
        if(i_11 < u32(192))
        {
        }
        else
        {
            break;
        }
        atomicStore(&(team_scratch_0[i_11]), u32(0));
        i_11 = i_11 + u32(32);
    }
    workgroupBarrier();
    var t_4 : u32 = the_thread_0;
    for(;;)
    {
        var _S150 : bool;
        if(t_4 < triangle_count_0)
        {
            _S150 = sound_1;
        }
        else
        {
            _S150 = false;
        }
        if(_S150)
        {
        }
        else
        {
            break;
        }
        var triangle_2 : u32 = packed_triangle_0(t_4);
        var _S151 : u32 = geo_shift_0();
        var _S152 : Triple_0 = triangle_normal_0(triangle_2, _S151);
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
            var place_2 : u32 = u32(3) * ((((triangle_2 >> ((u32(8) * corner_0)))) & (u32(63))));
            var _S153 : u32 = atomicAdd(&(team_scratch_0[place_2]), _S152.x_2);
            var _S154 : u32 = atomicAdd(&(team_scratch_0[place_2 + u32(1)]), _S152.y_2);
            var _S155 : u32 = atomicAdd(&(team_scratch_0[place_2 + u32(2)]), _S152.z_1);
            corner_0 = corner_0 + u32(1);
        }
        t_4 = t_4 + u32(32);
    }
    workgroupBarrier();
    return;
}

fn magnitude_0( x_5 : u32) -> u32
{
    var _S156 : u32;
    if(i32(x_5) < i32(0))
    {
        _S156 = u32(0) - x_5;
    }
    else
    {
        _S156 = x_5;
    }
    return _S156;
}

fn magnitudes_0( v_2 : Triple_0) -> u32
{
    return ((((magnitude_0(v_2.x_2)) | ((magnitude_0(v_2.y_2))))) | ((magnitude_0(v_2.z_1))));
}

fn bit_length_0( x_6 : u32) -> u32
{
    return firstbithigh_0(x_6) + u32(1);
}

struct OctPair_0
{
     u_1 : u32,
     v_3 : u32,
};

fn octahedral_prediction_0( normal_x_0 : u32,  normal_y_0 : u32,  normal_z_0 : u32,  bits_5 : u32) -> OctPair_0
{
    var n_12 : Triple_0;
    n_12.x_2 = normal_x_0;
    n_12.y_2 = normal_y_0;
    n_12.z_1 = normal_z_0;
    var k_3 : u32 = excess_0(bit_length_0(magnitudes_0(n_12)), u32(13));
    var limit_0 : u32 = ((u32(1) << (bits_5))) - u32(2);
    var x_7 : u32 = ((magnitude_0(normal_x_0)) >> (k_3));
    var y_4 : u32 = ((magnitude_0(normal_y_0)) >> (k_3));
    var sum_2 : u32 = x_7 + y_4 + (((magnitude_0(normal_z_0)) >> (k_3)));
    var q_2 : OctPair_0;
    var _S157 : u32 = (limit_0 >> (u32(1)));
    q_2.u_1 = _S157;
    q_2.v_3 = _S157;
    if(sum_2 == u32(0))
    {
        return q_2;
    }
    var below_0 : bool = i32(n_12.z_1) < i32(0);
    var u_2 : u32;
    if(below_0)
    {
        u_2 = sum_2 - y_4;
    }
    else
    {
        u_2 = x_7;
    }
    var v_4 : u32;
    if(below_0)
    {
        v_4 = sum_2 - x_7;
    }
    else
    {
        v_4 = y_4;
    }
    if(i32(n_12.x_2) < i32(0))
    {
        u_2 = sum_2 - u_2;
    }
    else
    {
        u_2 = sum_2 + u_2;
    }
    if(i32(n_12.y_2) < i32(0))
    {
        v_4 = sum_2 - v_4;
    }
    else
    {
        v_4 = sum_2 + v_4;
    }
    var _S158 : u32 = u32(2) * sum_2;
    var _S159 : u32 = (u_2 * limit_0 + sum_2) / _S158;
    q_2.u_1 = _S159;
    var _S160 : u32 = (v_4 * limit_0 + sum_2) / _S158;
    q_2.v_3 = _S160;
    return q_2;
}

fn bits_mask_0( s_23 : u32) -> u32
{
    var _S161 : u32 = (extractBits((shared_stream_0[s_23]), u32((i32(3))), u32((i32(6)))));
    return word_below_0(_S161);
}

fn predict_team_geo_0( s_24 : u32)
{
    var i_12 : u32 = the_thread_0;
    for(;;)
    {
        if(i_12 < traversed_count_0)
        {
        }
        else
        {
            break;
        }
        var id_6 : u32 = (extractBits((team_traversal_0[i_12]), u32((i32(16))), u32((i32(6)))));
        var place_3 : u32 = u32(3) * id_6;
        var _S162 : u32 = atomicLoad(&(team_scratch_0[place_3]));
        var _S163 : u32 = atomicLoad(&(team_scratch_0[place_3 + u32(1)]));
        var _S164 : u32 = atomicLoad(&(team_scratch_0[place_3 + u32(2)]));
        var _S165 : u32 = (extractBits((shared_stream_0[s_24]), u32((i32(3))), u32((i32(6)))));
        var _S166 : OctPair_0 = octahedral_prediction_0(_S162, _S163, _S164, (_S165 & (u32(31))));
        var c_5 : u32 = u32(0);
        for(;;)
        {
            if(c_5 < u32(2))
            {
            }
            else
            {
                break;
            }
            var _S167 : u32 = value_element_0(s_24, c_5);
            var _S168 : u32;
            if(c_5 == u32(0))
            {
                _S168 = _S166.u_1;
            }
            else
            {
                _S168 = _S166.v_3;
            }
            var _S169 : u32 = _S168 + team_values_0[_S167 + id_6];
            var _S170 : u32 = bits_mask_0(s_24);
            team_values_0[_S167 + id_6] = (_S169 & (_S170));
            c_5 = c_5 + u32(1);
        }
        i_12 = i_12 + u32(32);
    }
    return;
}

fn runs_backwards_0( h_4 : Header_0,  r_4 : u32,  s_25 : u32) -> bool
{
    return mask_test_0(((h_4.foreign_refs_1) & ((~team_seam_refs_0[s_25]))), r_4);
}

fn mask_msb_0( m_8 : vec2<u32>) -> u32
{
    var _S171 : u32 = m_8.y;
    var _S172 : u32;
    if(_S171 != u32(0))
    {
        _S172 = u32(32) + firstbithigh_0(_S171);
    }
    else
    {
        var _S173 : u32 = m_8.x;
        if(_S173 != u32(0))
        {
            _S172 = firstbithigh_0(_S173);
        }
        else
        {
            _S172 = u32(64);
        }
    }
    return _S172;
}

fn loop_begin_0( h_5 : Header_0,  r_5 : u32) -> u32
{
    var before_5 : vec2<u32> = ((h_5.loop_ends_2) & ((mask_below_0(r_5))));
    var _S174 : u32;
    if(mask_any_0(before_5))
    {
        _S174 = mask_msb_0(before_5) + u32(1);
    }
    else
    {
        _S174 = u32(0);
    }
    return _S174;
}

fn next_reference_0( h_6 : Header_0,  r_6 : u32) -> u32
{
    var _S175 : u32;
    if(mask_test_0(h_6.loop_ends_2, r_6))
    {
        _S175 = loop_begin_0(h_6, r_6);
    }
    else
    {
        _S175 = r_6 + u32(1);
    }
    return _S175;
}

fn first_id_0( r_7 : u32) -> u32
{
    var _S176 : u32 = loop_id_0(team_references_0[(r_7 & (u32(63)))]);
    return _S176;
}

fn run_id_0( h_7 : Header_0,  r_8 : u32,  backwards_0 : bool,  i_13 : u32) -> u32
{
    var length_1 : u32 = reference_length_of_0(r_8);
    var place_4 : u32;
    if(backwards_0)
    {
        place_4 = length_1 - i_13;
    }
    else
    {
        place_4 = i_13;
    }
    if(place_4 == length_1)
    {
        var _S177 : u32 = first_id_0(next_reference_0(h_7, r_8));
        return _S177;
    }
    var _S178 : u32 = loop_id_0((((team_references_0[(r_8 & (u32(63)))]) & (u32(63)))) + place_4);
    return _S178;
}

fn chain_step_of_0( h_8 : Header_0,  s_26 : u32,  item_1 : u32,  step_0 : ptr<function, u32>) -> bool
{
    var r_9 : u32 = ((mask_count_0((team_ranks_0 & ((mask_below_0(item_1 + u32(1)))))) - u32(1)) & (u32(63)));
    var length_2 : u32 = reference_length_of_0(r_9);
    var backwards_1 : bool = runs_backwards_0(h_8, r_9, s_26);
    var i_14 : u32 = item_1 - (((team_references_0[r_9]) & (u32(63))));
    (*step_0) = u32(4278190080);
    var _S179 : bool;
    if(i_14 == u32(0))
    {
        _S179 = true;
    }
    else
    {
        _S179 = i_14 >= length_2;
    }
    if(_S179)
    {
        _S179 = true;
    }
    else
    {
        _S179 = mask_test_0(h_8.private_refs_1, r_9);
    }
    if(_S179)
    {
        return false;
    }
    var i_15 : u32;
    if(backwards_1)
    {
        i_15 = length_2 - i_14;
    }
    else
    {
        i_15 = i_14;
    }
    var _S180 : u32 = run_id_0(h_8, r_9, backwards_1, i_15);
    var _S181 : u32 = run_id_0(h_8, r_9, backwards_1, i_15 - u32(1));
    var _S182 : u32 = run_id_0(h_8, r_9, backwards_1, length_2);
    if(i_15 < u32(2))
    {
        i_15 = u32(255);
    }
    else
    {
        var _S183 : u32 = run_id_0(h_8, r_9, backwards_1, i_15 - u32(2));
        i_15 = _S183;
    }
    (*step_0) = pack4_0(_S180, _S181, _S182, i_15);
    return true;
}

fn dot3_0( v_5 : Triple_0,  w_7 : Triple_0) -> u32
{
    return v_5.x_2 * w_7.x_2 + v_5.y_2 * w_7.y_2 + v_5.z_1 * w_7.z_1;
}

fn signed_quotient_0( x_8 : u32,  d_0 : u32) -> u32
{
    var quotient_1 : u32 = magnitude_0(x_8) / d_0;
    var _S184 : u32;
    if(i32(x_8) < i32(0))
    {
        _S184 = u32(0) - quotient_1;
    }
    else
    {
        _S184 = quotient_1;
    }
    return _S184;
}

struct Weights_0
{
     exist_0 : bool,
     s_27 : u32,
     u_3 : u32,
};

fn affine_weights_0( a_2 : u32,  b_1 : u32,  o_0 : u32,  v_6 : u32) -> Weights_0
{
    var origin_0 : Triple_0 = grid_position_0(a_2);
    var e_1 : Triple_0 = difference_0(grid_position_0(b_1), origin_0);
    var f_1 : Triple_0 = difference_0(grid_position_0(o_0), origin_0);
    var r_10 : Triple_0 = difference_0(grid_position_0(v_6), origin_0);
    var h_9 : u32 = excess_0(bit_length_0(((((magnitudes_0(e_1)) | ((magnitudes_0(f_1))))) | ((magnitudes_0(r_10))))), u32(14));
    var e_2 : Triple_0 = shifted_0(e_1, h_9);
    var f_2 : Triple_0 = shifted_0(f_1, h_9);
    var r_11 : Triple_0 = shifted_0(r_10, h_9);
    var ee_0 : u32 = dot3_0(e_2, e_2);
    var ff_0 : u32 = dot3_0(f_2, f_2);
    var re_0 : u32 = dot3_0(r_11, e_2);
    var rf_0 : u32 = dot3_0(r_11, f_2);
    var n_13 : u32 = bit_length_0((((((ee_0 | (ff_0))) | ((magnitude_0(re_0))))) | ((magnitude_0(rf_0)))));
    var up_0 : u32 = excess_0(u32(15), n_13);
    var down_0 : u32 = excess_0(n_13, u32(15));
    var ee_1 : u32 = shift_right_0((ee_0 << (up_0)), down_0);
    var ef_0 : u32 = shift_right_0(((dot3_0(e_2, f_2)) << (up_0)), down_0);
    var ff_1 : u32 = shift_right_0((ff_0 << (up_0)), down_0);
    var re_1 : u32 = shift_right_0((re_0 << (up_0)), down_0);
    var rf_1 : u32 = shift_right_0((rf_0 << (up_0)), down_0);
    var product_0 : u32 = ee_1 * ff_1;
    var determinant_0 : u32 = product_0 - ef_0 * ef_0;
    var d_1 : u32 = (determinant_0 >> (u32(8)));
    var w_8 : Weights_0;
    var _S185 : bool;
    if(i32(determinant_0) > ((i32(product_0) >> (u32(5)))))
    {
        _S185 = d_1 != u32(0);
    }
    else
    {
        _S185 = false;
    }
    w_8.exist_0 = _S185;
    w_8.s_27 = u32(0);
    w_8.u_3 = u32(0);
    if(!_S185)
    {
        return w_8;
    }
    var _S186 : u32 = signed_quotient_0(re_1 * ff_1 - rf_1 * ef_0, d_1);
    w_8.s_27 = _S186;
    var _S187 : u32 = signed_quotient_0(rf_1 * ee_1 - re_1 * ef_0, d_1);
    w_8.u_3 = _S187;
    if((magnitude_0(_S186)) < u32(1024))
    {
        _S185 = (magnitude_0(w_8.u_3)) < u32(1024);
    }
    else
    {
        _S185 = false;
    }
    w_8.exist_0 = _S185;
    return w_8;
}

fn line_weights_0( a_3 : u32,  b_2 : u32,  v_7 : u32) -> Weights_0
{
    var origin_1 : Triple_0 = grid_position_0(a_3);
    var e_3 : Triple_0 = difference_0(grid_position_0(b_2), origin_1);
    var r_12 : Triple_0 = difference_0(grid_position_0(v_7), origin_1);
    var h_10 : u32 = excess_0(bit_length_0(((magnitudes_0(e_3)) | ((magnitudes_0(r_12))))), u32(10));
    var e_4 : Triple_0 = shifted_0(e_3, h_10);
    var ee_2 : u32 = dot3_0(e_4, e_4);
    var re_2 : u32 = dot3_0(shifted_0(r_12, h_10), e_4);
    var w_9 : Weights_0;
    var _S188 : i32 = i32(ee_2);
    var _S189 : bool;
    if(_S188 > i32(0))
    {
        _S189 = i32(re_2) >= i32(0);
    }
    else
    {
        _S189 = false;
    }
    if(_S189)
    {
        _S189 = i32(re_2) <= _S188;
    }
    else
    {
        _S189 = false;
    }
    w_9.exist_0 = _S189;
    w_9.s_27 = u32(0);
    w_9.u_3 = u32(0);
    if(_S189)
    {
        var _S190 : u32 = (re_2 * u32(256) + ((ee_2 >> (u32(1))))) / ee_2;
        w_9.s_27 = _S190;
    }
    return w_9;
}

fn pack_weights_0( w_10 : Weights_0) -> u32
{
    var _S191 : u32;
    if(w_10.exist_0)
    {
        _S191 = ((((((w_10.s_27) & (u32(4095)))) | ((((((w_10.u_3) & (u32(4095)))) << (u32(12))))))) | (u32(2147483648)));
    }
    else
    {
        _S191 = u32(0);
    }
    return _S191;
}

fn find_weights_0( h_11 : Header_0,  s_28 : u32,  chains_2 : bool)
{
    var _S192 : u32;
    if(chains_2)
    {
        if((h_11.references_1) > u32(0))
        {
            _S192 = mask_count_0(team_boundary_0);
        }
        else
        {
            _S192 = u32(0);
        }
    }
    else
    {
        _S192 = traversed_count_0;
    }
    var item_2 : u32 = the_thread_0;
    for(;;)
    {
        if(item_2 < _S192)
        {
        }
        else
        {
            break;
        }
        var _S193 : u32 = (item_2 & (u32(63)));
        var step_1 : u32 = ((((((((team_traversal_0[_S193]) >> (u32(16)))) & (u32(255)))) | ((((((team_traversal_0[_S193]) & (u32(65535)))) << (u32(8))))))) | ((((team_traversal_0[_S193]) & (u32(4278190080))))));
        var _S194 : bool;
        if(chains_2)
        {
            var _S195 : bool = chain_step_of_0(h_11, s_28, item_2, &(step_1));
            _S194 = !_S195;
        }
        else
        {
            _S194 = false;
        }
        if(_S194)
        {
            item_2 = item_2 + u32(32);
            continue;
        }
        var w_11 : Weights_0;
        w_11.exist_0 = false;
        var v_8 : u32 = (step_1 & (u32(63)));
        var a_4 : u32 = (((step_1 >> (u32(8)))) & (u32(63)));
        var b_3 : u32 = (((step_1 >> (u32(16)))) & (u32(63)));
        if(((step_1 >> (u32(24)))) != u32(255))
        {
            var _S196 : Weights_0 = affine_weights_0(a_4, b_3, (((step_1 >> (u32(24)))) & (u32(63))), v_8);
            w_11 = _S196;
        }
        var _S197 : bool;
        if(chains_2)
        {
            _S197 = !w_11.exist_0;
        }
        else
        {
            _S197 = false;
        }
        if(_S197)
        {
            var _S198 : Weights_0 = line_weights_0(a_4, b_3, v_8);
            w_11 = _S198;
        }
        team_seams_0[_S193] = pack_weights_0(w_11);
        item_2 = item_2 + u32(32);
    }
    return;
}

fn element_total_0() -> u32
{
    var _S199 : u32 = (extractBits((shared_stream_0[stream_end_0 - u32(1)]), u32((i32(12))), u32((i32(11)))));
    var _S200 : u32 = (extractBits((shared_stream_0[stream_end_0 - u32(1)]), u32((i32(0))), u32((i32(3)))));
    return min(_S199 + _S200, u32(20));
}

fn stream_of_element_0( element_3 : u32) -> vec2<u32>
{
    var s_29 : u32 = u32(0);
    var next_2 : u32 = u32(1);
    for(;;)
    {
        if(next_2 < stream_end_0)
        {
        }
        else
        {
            break;
        }
        var _S201 : u32 = (extractBits((shared_stream_0[next_2]), u32((i32(12))), u32((i32(11)))));
        if(element_3 >= _S201)
        {
            s_29 = next_2;
        }
        next_2 = next_2 + u32(1);
    }
    var _S202 : u32 = (extractBits((shared_stream_0[s_29]), u32((i32(12))), u32((i32(11)))));
    return vec2<u32>(s_29, element_3 - _S202);
}

fn Weights_x24init_0( exist_1 : bool,  s_30 : u32,  u_4 : u32) -> Weights_0
{
    var _S203 : Weights_0;
    _S203.exist_0 = exist_1;
    _S203.s_27 = s_30;
    _S203.u_3 = u_4;
    return _S203;
}

fn unpack_weights_0( word_8 : u32) -> Weights_0
{
    var _S204 : i32 = i32(word_8);
    var _S205 : i32 = (extractBits((_S204), u32((i32(0))), u32((i32(12)))));
    var _S206 : u32 = u32(_S205);
    var _S207 : i32 = (extractBits((_S204), u32((i32(12))), u32((i32(12)))));
    return Weights_x24init_0(true, _S206, u32(_S207));
}

fn affine_point_0( w_12 : Weights_0,  a_5 : u32,  b_4 : u32,  o_1 : u32) -> u32
{
    return a_5 + shift_right_0(w_12.s_27 * (b_4 - a_5) + w_12.u_3 * (o_1 - a_5) + u32(128), u32(8));
}

fn divide_0( x_9 : u32,  n_14 : u32) -> u32
{
    var _S208 : u32 = x_9 / n_14;
    return _S208;
}

fn toward_0( a_6 : u32,  b_5 : u32,  n_15 : u32) -> u32
{
    var _S209 : u32 = divide_0(b_5 - a_6 + ((n_15 >> (u32(1)))) + ((n_15 << (u32(24)))), n_15);
    return a_6 + _S209 - u32(16777216);
}

fn predict_chain_0( h_12 : Header_0,  r_13 : u32,  s_31 : u32,  element_4 : u32)
{
    var _S210 : u32 = (extractBits((shared_stream_0[s_31]), u32((i32(9))), u32((i32(3)))));
    var base_3 : u32 = min(element_4, u32(19)) * u32(64);
    var _S211 : u32 = bits_mask_0(s_31);
    var length_3 : u32 = reference_length_of_0(r_13);
    var backwards_2 : bool = runs_backwards_0(h_12, r_13, s_31);
    var rank_3 : u32 = ((team_references_0[(r_13 & (u32(63)))]) & (u32(63)));
    var to_1 : u32 = first_id_0(next_reference_0(h_12, r_13));
    var prev_0 : u32;
    if(backwards_2)
    {
        prev_0 = to_1;
    }
    else
    {
        var _S212 : u32 = loop_id_0(rank_3);
        prev_0 = _S212;
    }
    var prev_1 : u32 = team_values_0[base_3 + prev_0];
    if(backwards_2)
    {
        var _S213 : u32 = loop_id_0(rank_3);
        prev_0 = _S213;
    }
    else
    {
        prev_0 = to_1;
    }
    var _S214 : u32 = team_values_0[base_3 + prev_0];
    prev_0 = prev_1;
    var before_6 : u32 = prev_1;
    var left_0 : u32 = length_3;
    for(;;)
    {
        if(left_0 > u32(1))
        {
        }
        else
        {
            break;
        }
        var _S215 : u32;
        if(backwards_2)
        {
            _S215 = left_0 - u32(1);
        }
        else
        {
            _S215 = length_3 + u32(1) - left_0;
        }
        var place_5 : u32 = rank_3 + _S215;
        var _S216 : u32 = loop_id_0(place_5);
        var v_9 : u32 = base_3 + _S216;
        var weights_0 : u32;
        if(_S210 == u32(5))
        {
            weights_0 = team_seams_0[(place_5 & (u32(63)))];
        }
        else
        {
            weights_0 = u32(0);
        }
        var point_0 : u32;
        if(weights_0 != u32(0))
        {
            var _S217 : Weights_0 = unpack_weights_0(weights_0);
            point_0 = affine_point_0(_S217, prev_0, _S214, before_6);
        }
        else
        {
            if(_S210 != u32(2))
            {
                var _S218 : u32 = toward_0(prev_0, _S214, left_0);
                point_0 = _S218;
            }
            else
            {
                point_0 = prev_0;
            }
        }
        var prev_2 : u32 = ((point_0 + team_values_0[v_9]) & (_S211));
        team_values_0[v_9] = prev_2;
        var _S219 : u32 = left_0 - u32(1);
        before_6 = prev_0;
        prev_0 = prev_2;
        left_0 = _S219;
    }
    return;
}

fn predict_chains_0( h_13 : Header_0,  s_32 : u32,  only_seams_0 : bool)
{
    var one_0 : bool = s_32 < u32(8);
    var _S220 : u32;
    if(one_0)
    {
        var _S221 : u32 = (extractBits((shared_stream_0[s_32]), u32((i32(12))), u32((i32(11)))));
        _S220 = _S221;
    }
    else
    {
        _S220 = u32(0);
    }
    var item_3 : u32;
    if(one_0)
    {
        var _S222 : u32 = (extractBits((shared_stream_0[s_32]), u32((i32(0))), u32((i32(3)))));
        item_3 = _S222;
    }
    else
    {
        var _S223 : u32 = element_total_0();
        item_3 = _S223;
    }
    var _S224 : u32 = max(item_3, u32(1));
    item_3 = the_thread_0;
    for(;;)
    {
        if(item_3 < (h_13.references_1 * _S224))
        {
        }
        else
        {
            break;
        }
        var r_14 : u32 = item_3 / _S224;
        var element_5 : u32 = _S220 + item_3 - r_14 * _S224;
        var of_0 : u32;
        if(one_0)
        {
            of_0 = s_32;
        }
        else
        {
            var _S225 : vec2<u32> = stream_of_element_0(element_5);
            of_0 = _S225.x;
        }
        if(mask_test_0(h_13.private_refs_1, r_14))
        {
            item_3 = item_3 + u32(32);
            continue;
        }
        var _S226 : bool;
        if(!one_0)
        {
            var _S227 : u32 = (extractBits((shared_stream_0[of_0]), u32((i32(9))), u32((i32(3)))));
            _S226 = _S227 == u32(5);
        }
        else
        {
            _S226 = false;
        }
        if(_S226)
        {
            item_3 = item_3 + u32(32);
            continue;
        }
        var _S228 : bool;
        if(only_seams_0)
        {
            _S228 = !mask_test_0(team_seam_refs_0[of_0], r_14);
        }
        else
        {
            _S228 = false;
        }
        if(_S228)
        {
            item_3 = item_3 + u32(32);
            continue;
        }
        predict_chain_0(h_13, r_14, of_0, element_5);
        item_3 = item_3 + u32(32);
    }
    return;
}

fn predict_element_0( s_33 : u32,  c_6 : u32)
{
    var predictor_0 : u32 = (extractBits((shared_stream_0[s_33]), u32((i32(9))), u32((i32(3)))));
    var _S229 : u32 = bits_mask_0(s_33);
    var _S230 : u32 = value_element_0(s_33, c_6);
    var copies_0 : bool = predictor_0 == u32(2);
    var damped_0 : bool = predictor_0 == u32(3);
    var _S231 : bool = predictor_0 == u32(5);
    var _S232 : bool;
    if(predictor_0 != u32(1))
    {
        _S232 = !copies_0;
    }
    else
    {
        _S232 = false;
    }
    var _S233 : u32;
    if(damped_0)
    {
        _S233 = u32(3);
    }
    else
    {
        _S233 = u32(1);
    }
    var _S234 : u32;
    if(damped_0)
    {
        _S234 = u32(4294967294);
    }
    else
    {
        _S234 = u32(4294967295);
    }
    var _S235 : u32;
    if(damped_0)
    {
        _S235 = u32(2);
    }
    else
    {
        _S235 = u32(0);
    }
    var _S236 : i32;
    if(damped_0)
    {
        _S236 = i32(2);
    }
    else
    {
        _S236 = i32(0);
    }
    var _S237 : i32;
    if(copies_0)
    {
        _S237 = i32(0);
    }
    else
    {
        _S237 = i32(1);
    }
    var i_16 : u32 = u32(0);
    for(;;)
    {
        if(i_16 < traversed_count_0)
        {
        }
        else
        {
            break;
        }
        var triangle_3 : u32 = team_traversal_0[i_16];
        var _S238 : u32 = (extractBits((team_traversal_0[i_16]), u32((i32(16))), u32((i32(6)))));
        var residual_1 : u32 = team_values_0[_S230 + _S238];
        var a_7 : u32 = team_values_0[_S230 + ((triangle_3 & (u32(63))))];
        var _S239 : u32 = (extractBits((triangle_3), u32((i32(8))), u32((i32(6)))));
        var b_6 : u32 = team_values_0[_S230 + _S239];
        var _S240 : u32 = (extractBits((triangle_3), u32((i32(24))), u32((i32(6)))));
        var o_2 : u32 = team_values_0[_S230 + _S240];
        var sum_3 : u32;
        if(copies_0)
        {
            sum_3 = a_7;
        }
        else
        {
            sum_3 = a_7 + b_6;
        }
        var across_0 : bool;
        if(_S232)
        {
            across_0 = triangle_3 < u32(4278190080);
        }
        else
        {
            across_0 = false;
        }
        var point_1 : u32;
        if(across_0)
        {
            point_1 = _S233 * sum_3 + _S234 * o_2 + _S235;
        }
        else
        {
            point_1 = sum_3;
        }
        var _S241 : i32 = i32(point_1);
        var _S242 : i32;
        if(across_0)
        {
            _S242 = _S236;
        }
        else
        {
            _S242 = _S237;
        }
        var _S243 : u32 = u32((_S241 >> (u32(_S242))));
        var point_2 : u32;
        if(_S231)
        {
            var weights_1 : u32 = team_seams_0[i_16];
            if((team_seams_0[i_16]) != u32(0))
            {
                var _S244 : Weights_0 = unpack_weights_0(weights_1);
                point_2 = affine_point_0(_S244, a_7, b_6, o_2);
            }
            else
            {
                point_2 = _S243;
            }
        }
        else
        {
            point_2 = _S243;
        }
        team_values_0[_S230 + _S238] = ((point_2 + residual_1) & (_S229));
        i_16 = i_16 + u32(1);
    }
    return;
}

fn predict_0( h_14 : Header_0,  sound_2 : bool,  only_seams_1 : bool,  has_chains_0 : bool)
{
    var geo_0 : bool = any_stream_predicts_0(u32(16));
    var affine_0 : bool = any_stream_predicts_0(u32(32));
    var traversal_0 : u32 = push_0.streams_0 + u32(1);
    var _S245 : bool;
    if(geo_0)
    {
        _S245 = true;
    }
    else
    {
        _S245 = affine_0;
    }
    var _S246 : u32;
    if(_S245)
    {
        _S246 = traversal_0 + u32(1);
    }
    else
    {
        _S246 = traversal_0;
    }
    var step_2 : u32;
    if(has_chains_0)
    {
        step_2 = u32(0);
    }
    else
    {
        step_2 = traversal_0;
    }
    for(;;)
    {
        if(step_2 <= _S246)
        {
        }
        else
        {
            break;
        }
        var chains_3 : bool = step_2 < traversal_0;
        if(chains_3)
        {
            _S245 = step_2 > u32(0);
        }
        else
        {
            _S245 = false;
        }
        var s_34 : u32;
        if(_S245)
        {
            s_34 = step_2 - u32(1);
        }
        else
        {
            s_34 = u32(8);
        }
        var _S247 : bool = s_34 < u32(8);
        var _S248 : bool;
        if(_S247)
        {
            _S248 = ((the_blob_0[u32(8) + u32(7) * s_34] >> (u32(24)))) != u32(5);
        }
        else
        {
            _S248 = false;
        }
        if(_S248)
        {
            step_2 = step_2 + u32(1);
            continue;
        }
        workgroupBarrier();
        var after_0 : bool = step_2 > traversal_0;
        var _S249 : bool;
        if(after_0)
        {
            _S249 = geo_0;
        }
        else
        {
            _S249 = false;
        }
        if(_S249)
        {
            sum_team_normals_0(sound_2);
        }
        var of_1 : u32 = u32(0);
        for(;;)
        {
            var _S250 : bool;
            if(of_1 < stream_end_0)
            {
                _S250 = after_0;
            }
            else
            {
                _S250 = false;
            }
            var _S251 : bool;
            if(_S250)
            {
                _S251 = sound_2;
            }
            else
            {
                _S251 = false;
            }
            if(_S251)
            {
            }
            else
            {
                break;
            }
            var _S252 : u32 = (extractBits((shared_stream_0[of_1]), u32((i32(9))), u32((i32(3)))));
            if(_S252 == u32(4))
            {
                predict_team_geo_0(of_1);
            }
            of_1 = of_1 + u32(1);
        }
        var _S253 : bool;
        if(after_0)
        {
            _S253 = affine_0;
        }
        else
        {
            _S253 = _S247;
        }
        if(_S253)
        {
            if(sound_2)
            {
                find_weights_0(h_14, s_34, chains_3);
            }
            workgroupBarrier();
        }
        var _S254 : bool;
        if(chains_3)
        {
            _S254 = sound_2;
        }
        else
        {
            _S254 = false;
        }
        if(_S254)
        {
            predict_chains_0(h_14, s_34, only_seams_1);
        }
        var element_6 : u32 = the_thread_0;
        for(;;)
        {
            var _S255 : u32 = element_total_0();
            var _S256 : bool;
            if(element_6 < _S255)
            {
                _S256 = !chains_3;
            }
            else
            {
                _S256 = false;
            }
            var _S257 : bool;
            if(_S256)
            {
                _S257 = sound_2;
            }
            else
            {
                _S257 = false;
            }
            if(_S257)
            {
            }
            else
            {
                break;
            }
            var of_2 : vec2<u32> = stream_of_element_0(element_6);
            var _S258 : u32 = of_2.x;
            var predictor_1 : u32 = (extractBits((shared_stream_0[_S258]), u32((i32(9))), u32((i32(3)))));
            var _S259 : bool;
            if(after_0)
            {
                _S259 = predictor_1 == u32(5);
            }
            else
            {
                _S259 = predictor_1 < u32(4);
            }
            if(_S259)
            {
                predict_element_0(_S258, of_2.y);
            }
            element_6 = element_6 + u32(32);
        }
        step_2 = step_2 + u32(1);
    }
    return;
}

fn put_field_0( at_2 : u32,  value_3 : u32) -> vec2<u32>
{
    var _S260 : vec2<u32>;
    if(at_2 < u32(32))
    {
        _S260 = vec2<u32>((value_3 << (at_2)), (((value_3 >> (u32(1)))) >> ((u32(31) - at_2))));
    }
    else
    {
        _S260 = vec2<u32>(u32(0), (value_3 << ((at_2 - u32(32)))));
    }
    return _S260;
}

fn put_vertex_0( s_35 : u32,  id_7 : u32,  fields_2 : vec2<u32>)
{
    var word_9 : u32 = word_of_0(s_35, id_7);
    var _S261 : u32 = (extractBits((shared_places_0[s_35]), u32((i32(16))), u32((i32(6)))));
    if(_S261 == u32(1))
    {
        all_values_0[the_values_0 + word_9] = fields_2.x;
    }
    else
    {
        var _S262 : u32 = u32(2) * ((word_9 >> (u32(1))));
        all_values_0[the_values_0 + _S262] = fields_2.x;
        all_values_0[the_values_0 + _S262 + u32(1)] = fields_2.y;
    }
    return;
}

fn put_value_0( s_36 : u32,  c_7 : u32,  id_8 : u32,  value_4 : u32)
{
    var _S263 : u32 = bits_mask_0(s_36);
    var inside_0 : u32 = (value_4 & (_S263));
    var _S264 : bool = is_packed_0(s_36);
    if(!_S264)
    {
        var _S265 : u32 = the_values_0;
        var _S266 : u32 = word_of_0(s_36, id_8);
        all_values_0[_S265 + (_S266 + c_7)] = inside_0;
        return;
    }
    var before_7 : vec2<u32>;
    if(c_7 == u32(0))
    {
        before_7 = vec2<u32>(u32(0));
    }
    else
    {
        var _S267 : vec2<u32> = vertex_at_0(s_36, id_8);
        before_7 = _S267;
    }
    var _S268 : u32 = (extractBits((shared_places_0[s_36]), u32((i32(22))), u32((i32(6)))));
    put_vertex_0(s_36, id_8, (before_7 | ((put_field_0(c_7 * _S268, inside_0)))));
    return;
}

fn store_values_0( known_0 : vec2<u32>)
{
    var id_9 : u32 = the_thread_0;
    for(;;)
    {
        if(id_9 < vertex_count_0)
        {
        }
        else
        {
            break;
        }
        if(mask_test_0(known_0, id_9))
        {
            id_9 = id_9 + u32(32);
            continue;
        }
        var s_37 : u32 = u32(0);
        for(;;)
        {
            if(s_37 < stream_end_0)
            {
            }
            else
            {
                break;
            }
            var _S269 : vec2<u32> = vec2<u32>(u32(0));
            var c_8 : u32 = u32(0);
            var fields_3 : vec2<u32> = _S269;
            for(;;)
            {
                var _S270 : u32 = (extractBits((shared_stream_0[s_37]), u32((i32(0))), u32((i32(3)))));
                if(c_8 < _S270)
                {
                }
                else
                {
                    break;
                }
                var _S271 : u32 = value_element_0(s_37, c_8);
                var value_5 : u32 = team_values_0[_S271 + id_9];
                var _S272 : bool = is_packed_0(s_37);
                if(_S272)
                {
                    var _S273 : u32 = (extractBits((shared_places_0[s_37]), u32((i32(22))), u32((i32(6)))));
                    fields_3 = (fields_3 | ((put_field_0(c_8 * _S273, value_5))));
                }
                else
                {
                    put_value_0(s_37, c_8, id_9, value_5);
                }
                c_8 = c_8 + u32(1);
            }
            var _S274 : bool = is_packed_0(s_37);
            if(_S274)
            {
                put_vertex_0(s_37, id_9, fields_3);
            }
            s_37 = s_37 + u32(1);
        }
        id_9 = id_9 + u32(32);
    }
    return;
}

fn interior_shader_0()
{
    open_job_0(push_0.first_0 + the_workgroup_0.x);
    var summary_0 : u32 = atomicLoad(&(the_summaries_0[job_place_0]));
    var places_0 : Places_std430_0 = all_places_0[job_place_0];
    var _S275 : bool;
    if(((summary_0 >> (u32(16)))) == u32(0))
    {
        _S275 = (places_0.interior_0) != u32(4294967295);
    }
    else
    {
        _S275 = false;
    }
    var live_0 : u32;
    if(_S275)
    {
        live_0 = u32(1);
    }
    else
    {
        live_0 = u32(0);
    }
    var _S276 : u32 = (extractBits((places_0.counts_0), u32((i32(13))), u32((i32(3)))));
    var state_0 : u32 = uniform_word_0((live_0 | (((_S276 << (u32(1)))))));
    if(((state_0 & (u32(1)))) == u32(0))
    {
        return;
    }
    var seams_4 : bool = ((((state_0 >> (u32(1)))) & (u32(4)))) != u32(0);
    share_streams_0(job_streams_0());
    share_value_places_0();
    the_values_0 = job_values_0();
    team_triangles_0 = job_triangles_0();
    connected_0.boundary_0 = connectivity_0[job_place_0].boundary_0;
    connected_0.starts_0 = connectivity_0[job_place_0].starts_0;
    connected_0.closing_0 = connectivity_0[job_place_0].closing_0;
    connected_0.ends_0 = connectivity_0[job_place_0].ends_0;
    connected_0.splits_0 = connectivity_0[job_place_0].splits_0;
    connected_0.references_0 = connectivity_0[job_place_0].references_0;
    symbol_c_0 = connected_0.closing_0;
    symbol_e_0 = connected_0.ends_0;
    symbol_s_0 = connected_0.splits_0;
    triangle_count_0 = (summary_0 & (u32(127)));
    vertex_count_0 = min((((summary_0 >> (u32(8)))) & (u32(127))), u32(64));
    team_boundary_0 = connected_0.boundary_0;
    open_team_0();
    var s_38 : u32 = the_thread_0;
    for(;;)
    {
        if(s_38 < stream_total_0)
        {
        }
        else
        {
            break;
        }
        team_seam_refs_0[s_38] = mask_none_0();
        s_38 = s_38 + u32(32);
    }
    var _S277 : u32 = (extractBits((places_0.counts_0), u32((i32(7))), u32((i32(6)))));
    read_interior_codes_0(places_0.codes_0, mask_any_0(((mask_below_0(_S277)) & ((~(((places_0.foreign_refs_0) | ((places_0.private_refs_0)))))))));
    workgroupBarrier();
    if(the_thread_0 == u32(0))
    {
        team_interior_0 = places_0.interior_0;
        team_waiting_0 = places_0.waiting_0;
    }
    var h_15 : Header_0;
    h_15.references_1 = u32(0);
    h_15.flags_0 = u32(0);
    if(seams_4)
    {
        var _S278 : Header_0 = find_seams_of_0();
        h_15 = _S278;
    }
    workgroupBarrier();
    list_traversal_0();
    load_boundary_0();
    read_interior_0(true);
    var sound_3 : bool = agree_0();
    predict_0(h_15, sound_3, true, seams_4);
    workgroupBarrier();
    if(sound_3)
    {
        var _S279 : vec2<u32>;
        if((h_15.flags_0) != u32(0))
        {
            _S279 = mask_none_0();
        }
        else
        {
            _S279 = (team_boundary_0 & ((~places_0.waiting_0)));
        }
        store_values_0(_S279);
    }
    else
    {
        if(the_thread_0 == u32(0))
        {
            var _S280 : u32 = atomicOr(&(the_summaries_0[job_place_0]), (error_0 << (u32(16))));
        }
    }
    return;
}

@compute
@workgroup_size(32, 1, 1)
fn interior_main(@builtin(local_invocation_index) thread_0 : u32, @builtin(workgroup_id) workgroup_0 : vec3<u32>, @builtin(global_invocation_id) invocation_0 : vec3<u32>)
{
    the_thread_0 = thread_0;
    the_workgroup_0 = workgroup_0;
    the_invocation_0 = invocation_0;
    interior_shader_0();
    return;
}

