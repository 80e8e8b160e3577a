// Translated from shaders/decoders/interior.comp by tools/build_wgsl.py: do not edit.
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
        var _S10 : u32 = words_of_0(before_1);
        var words_1 : u32 = words_0 + _S10;
        before_1 = before_1 + u32(1);
        words_0 = words_1;
    }
    var _S11 : u32 = u32(64) * words_0;
    var _S12 : u32 = words_of_0(s_3);
    return vec2<u32>(_S11, _S12);
}

var<workgroup> shared_places_0 : array<u32, i32(8)>;

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
        var _S13 : u32 = ((((place_0.x) & (u32(65535)))) | ((((((place_0.y) & (u32(63)))) << (u32(16))))));
        var _S14 : u32 = field_of_0(s_4);
        var _S15 : u32 = (_S13 | (((_S14 << (u32(22))))));
        var _S16 : u32 = words_of_0(s_4);
        shared_places_0[s_4] = (_S15 | ((((min(_S16, u32(3))) << (u32(28))))));
        s_4 = s_4 + u32(32);
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
        var _S17 : vec2<u32> = mask_none_0();
        team_ranks_0 = _S17;
        team_waiting_0 = _S17;
    }
    workgroupBarrier();
    return;
}

var<workgroup> team_seam_refs_0 : array<vec2<u32>, i32(8)>;

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

fn code_at_0( p_1 : ptr<function, u32>,  s_5 : u32,  of_chains_0 : bool) -> u32
{
    var field_2 : u32 = load_bits_0((*p_1), u32(3));
    (*p_1) = (*p_1) + u32(3);
    if(field_2 == u32(7))
    {
        var _S21 : u32 = (extractBits((shared_stream_0[s_5]), u32((i32(0))), u32((i32(3)))));
        (*p_1) = (*p_1) + u32(5) * _S21;
        return u32(255);
    }
    var base_1 : u32;
    if(of_chains_0)
    {
        var _S22 : u32 = (extractBits((shared_bases_0[s_5]), u32((i32(0))), u32((i32(5)))));
        base_1 = _S22;
    }
    else
    {
        var _S23 : u32 = (extractBits((shared_bases_0[s_5]), u32((i32(8))), u32((i32(5)))));
        base_1 = _S23;
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
    var _S24 : u32 = (k_0 & (u32(31)));
    if(rice_0)
    {
        base_1 = u32(0);
    }
    else
    {
        base_1 = u32(32);
    }
    return (_S24 | (base_1));
}

var<workgroup> team_codes_0 : array<u32, i32(8)>;

fn read_interior_codes_0( p_2 : u32,  chains_1 : bool)
{
    var _S25 : u32 = p_2;
    team_codes_begin_0 = p_2;
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
        if(chains_1)
        {
            var _S26 : u32 = code_at_0(&(_S25), s_6, true);
        }
        var code_0 : u32 = code_at_0(&(_S25), s_6, false);
        var _S27 : u32 = (extractBits((shared_stream_0[s_6]), u32((i32(0))), u32((i32(3)))));
        var widths_0 : u32 = _S25 - u32(5) * _S27 - team_codes_begin_0;
        if(the_thread_0 == u32(0))
        {
            team_codes_0[s_6] = (code_0 | (((widths_0 << (u32(8))))));
        }
        s_6 = s_6 + u32(1);
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
    var _S28 : u32 = words_3.y;
    var _S29 : u32 = (p_3 & (u32(31)));
    return (vec2<u32>(funnel_0(words_3.x, _S28, _S29), funnel_0(_S28, words_3.z, _S29)) & ((mask_below_0(n_3))));
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
    var _S30 : vec2<u32> = load_mask_0(begin_0, count_1);
    planes_0.p0_0 = _S30;
    var p_4 : u32 = begin_0 + count_1;
    var count_2 : u32 = mask_count_0(_S30);
    var _S31 : vec2<u32> = load_mask_0(p_4, count_2);
    planes_0.p1_0 = _S31;
    var p_5 : u32 = p_4 + count_2;
    var count_3 : u32 = mask_count_0(_S31);
    var _S32 : vec2<u32> = load_mask_0(p_5, count_3);
    planes_0.p2_0 = _S32;
    var p_6 : u32 = p_5 + count_3;
    var count_4 : u32 = mask_count_0(_S32);
    planes_0.p3_0 = load_mask_0(p_6, count_4);
    planes_0.end_1 = p_6 + count_4;
    return planes_0;
}

fn mask_bit_0( i_7 : u32) -> vec2<u32>
{
    var _S33 : vec2<u32>;
    if(((i_7 & (u32(32)))) == u32(0))
    {
        _S33 = vec2<u32>((u32(1) << (((i_7 & (u32(31)))))), u32(0));
    }
    else
    {
        _S33 = vec2<u32>(u32(0), (u32(1) << (((i_7 & (u32(31)))))));
    }
    return _S33;
}

fn mask_test_0( m_3 : vec2<u32>,  i_8 : u32) -> bool
{
    var _S34 : u32;
    if(((i_8 & (u32(32)))) == u32(0))
    {
        _S34 = m_3.x;
    }
    else
    {
        _S34 = m_3.y;
    }
    return ((((_S34 >> (((i_8 & (u32(31))))))) & (u32(1)))) != u32(0);
}

fn mask_shl1_0( m_4 : vec2<u32>) -> vec2<u32>
{
    var _S35 : u32 = m_4.x;
    return vec2<u32>((_S35 << (u32(1))), ((((m_4.y) << (u32(1)))) | (((_S35 >> (u32(31)))))));
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
    var _S36 : bool;
    if(m_5 >= meshlet_total_0)
    {
        _S36 = true;
    }
    else
    {
        _S36 = start_0 >= (byte_length_0 - u32(8));
    }
    var start_1 : u32;
    if(_S36)
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
    var _S37 : u32 = u32(6) + reference_width_0;
    var _S38 : u32 = (bits_1 >> (_S37));
    var p_8 : u32 = p_7 + _S37;
    h_0.flags_0 = u32(0);
    var bits_2 : u32 = _S38;
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
            var _S39 : u32 = p_9 + u32(1);
            bits_2 = (bits_2 >> (u32(1)));
            p_9 = _S39;
        }
        flag_0 = flag_0 + flag_0;
    }
    h_0.delta_width_0 = (((fields_0 >> (u32(5)))) & (u32(31)));
    h_0.slot_width_0 = (((fields_0 >> (u32(10)))) & (u32(7)));
    h_0.table_0 = (((fields_0 >> (u32(19)))) & (u32(1)));
    h_0.begin_1 = p_9;
    var _S40 : Planes_0 = load_planes_0(p_9, h_0.triangles_1);
    var r_0 : u32 = h_0.references_1;
    var all_0 : vec2<u32> = mask_below_0(h_0.references_1);
    var _S41 : vec2<u32> = mask_none_0();
    h_0.foreign_refs_1 = _S41;
    h_0.private_refs_1 = _S41;
    h_0.loop_ends_2 = _S41;
    h_0.length_width_0 = u32(0);
    if((h_0.references_1) == u32(0))
    {
        _S36 = (h_0.flags_0) != u32(0);
    }
    else
    {
        _S36 = false;
    }
    if(_S36)
    {
        error_0 = u32(4);
    }
    if(r_0 > u32(0))
    {
        h_0.foreign_refs_1 = load_mask_0(_S40.end_1, r_0);
        var p_10 : u32 = _S40.end_1 + r_0;
        var _S42 : u32 = r_0 - u32(1);
        h_0.loop_ends_2 = mask_bit_0(_S42);
        if((((h_0.flags_0) & (u32(1)))) != u32(0))
        {
            var _S43 : vec2<u32> = load_mask_0(p_10, r_0);
            h_0.loop_ends_2 = _S43;
            var p_11 : u32 = p_10 + r_0;
            if(!mask_test_0(_S43, _S42))
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
            var _S44 : vec2<u32> = load_mask_0(p_9, r_0);
            h_0.private_refs_1 = _S44;
            var p_12 : u32 = p_9 + r_0;
            if(mask_any_0((_S44 & ((h_0.foreign_refs_1)))))
            {
                error_0 = u32(4);
            }
            p_9 = p_12;
        }
        var _S45 : u32 = load_bits_0(p_9, u32(3));
        h_0.length_width_0 = _S45;
        var p_13 : u32 = p_9 + u32(3);
        if(_S45 > u32(6))
        {
            error_0 = u32(4);
        }
        p_9 = p_13;
    }
    else
    {
        p_9 = _S40.end_1;
    }
    var _S46 : vec2<u32> = (all_0 & ((~(((h_0.foreign_refs_1) | ((h_0.private_refs_1)))))));
    h_0.owned_refs_0 = _S46;
    var _S47 : vec2<u32> = (_S46 | ((((h_0.private_refs_1) & ((~lone_references_0(h_0.loop_ends_2)))))));
    h_0.sized_refs_0 = _S47;
    h_0.lengths_1 = p_9;
    var p_14 : u32 = p_9 + h_0.length_width_0 * mask_count_0(_S47);
    h_0.entries_1 = p_14;
    var _S48 : u32 = h_0.delta_width_0 + h_0.slot_width_0;
    if((((h_0.flags_0) & (u32(4)))) != u32(0))
    {
        start_1 = stream_total_0 - u32(1);
    }
    else
    {
        start_1 = u32(0);
    }
    var _S49 : u32 = _S48 + start_1;
    h_0.entry_width_0 = _S49;
    h_0.codes_1 = p_14 + _S49 * mask_count_0(h_0.foreign_refs_1);
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
    var _S50 : u32 = mask_count_0(starts_1);
    team_disks_0 = _S50;
    var _S51 : u32 = pushed_vertices_0(mask_below_0(triangle_count_0)) + _S50;
    vertex_count_0 = _S51;
    var _S52 : bool;
    if(_S51 > u32(64))
    {
        _S52 = true;
    }
    else
    {
        _S52 = team_disks_0 == u32(0);
    }
    if(_S52)
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
            _S52 = !mask_test_0(starts_1, t_0);
        }
        else
        {
            _S52 = false;
        }
        if(_S52)
        {
            t_0 = t_0 + u32(32);
            continue;
        }
        var before_2 : vec2<u32> = mask_below_0(t_0);
        var disk_0 : u32 = mask_count_0((starts_1 & (before_2)));
        var _S53 : u32 = pushed_vertices_0(before_2) + disk_0;
        if(t_0 == triangle_count_0)
        {
            ids_0 = vertex_count_0;
        }
        else
        {
            ids_0 = _S53;
        }
        var _S54 : u32 = atomicOr(&(team_begins_0[(disk_0 >> (u32(2)))]), ((min(ids_0, u32(64))) << ((u32(8) * ((disk_0 & (u32(3))))))));
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
        var _S55 : u32 = atomicOr(&(team_loop_0[(rank_0 >> (u32(2)))]), (ids_0 << ((u32(8) * ((rank_0 & (u32(3))))))));
        ids_0 = ids_0 + u32(32);
    }
    return;
}

fn mask_lsb_0( m_6 : vec2<u32>) -> u32
{
    var _S56 : u32 = m_6.x;
    var _S57 : u32;
    if(_S56 != u32(0))
    {
        _S57 = firstbitlow_0(_S56);
    }
    else
    {
        var _S58 : u32 = m_6.y;
        if(_S58 != u32(0))
        {
            _S57 = u32(32) + firstbitlow_0(_S58);
        }
        else
        {
            _S57 = u32(64);
        }
    }
    return _S57;
}

var<workgroup> team_references_0 : array<u32, i32(64)>;

fn place_team_references_0()
{
    var _S59 : u32 = mask_count_0(team_boundary_0);
    var rank_1 : u32 = the_thread_0;
    for(;;)
    {
        if(rank_1 < _S59)
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
        var _S60 : u32;
        if(mask_any_0(later_0))
        {
            _S60 = mask_lsb_0(later_0);
        }
        else
        {
            _S60 = _S59;
        }
        team_references_0[(r_1 & (u32(63)))] = (rank_1 | ((((_S60 - rank_1) << (u32(8))))));
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
    var _S61 : u32 = m_7.x;
    var _S62 : vec2<u32>;
    if(_S61 != u32(0))
    {
        _S62 = vec2<u32>((_S61 & ((_S61 - u32(1)))), m_7.y);
    }
    else
    {
        var _S63 : u32 = m_7.y;
        _S62 = vec2<u32>(u32(0), (_S63 & ((_S63 - u32(1)))));
    }
    return _S62;
}

fn seam_references_0( h_1 : Header_0,  s_7 : u32) -> vec2<u32>
{
    var seams_0 : vec2<u32> = mask_none_0();
    var _S64 : bool;
    if(s_7 == u32(0))
    {
        _S64 = true;
    }
    else
    {
        _S64 = (((h_1.flags_0) & (u32(4)))) == u32(0);
    }
    if(_S64)
    {
        return seams_0;
    }
    var _S65 : u32 = h_1.entries_1 + h_1.delta_width_0 + h_1.slot_width_0 + s_7 - u32(1);
    var rest_1 : vec2<u32> = h_1.foreign_refs_1;
    var seams_1 : vec2<u32> = seams_0;
    var share_0 : u32 = _S65;
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
    var s_8 : u32 = the_thread_0;
    for(;;)
    {
        if(s_8 < stream_total_0)
        {
        }
        else
        {
            break;
        }
        team_seam_refs_0[s_8] = seam_references_0(h_2, s_8);
        s_8 = s_8 + u32(32);
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
    var _S66 : vec2<u32> = mask_none_0();
    var _S67 : vec2<u32> = symbol_c_0;
    var roots_0 : vec2<u32>;
    var introducing_0 : vec2<u32>;
    var t_2 : u32;
    if(mask_any_0(team_waiting_0))
    {
        var rest_2 : vec2<u32> = starts_2;
        var waiting_2 : vec2<u32> = waiting_1;
        roots_0 = _S66;
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
            var _S68 : vec2<u32> = (roots_0 | ((mask_bit_0(t_3))));
            waiting_2 = (waiting_2 & ((~mask_bit_0(a_0))));
            roots_0 = _S68;
            rest_2 = mask_clear_lsb_0(rest_2);
        }
        introducing_0 = _S67;
        t_2 = u32(0);
        for(;;)
        {
            var _S69 : bool;
            if(t_2 < triangle_count_0)
            {
                _S69 = mask_any_0(waiting_2);
            }
            else
            {
                _S69 = false;
            }
            if(_S69)
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
            var _S70 : vec2<u32> = (introducing_0 | ((mask_bit_0(t_2))));
            waiting_2 = (waiting_2 & ((~mask_bit_0(v_0))));
            introducing_0 = _S70;
            t_2 = t_2 + u32(1);
        }
        if(mask_any_0(waiting_2))
        {
            error_0 = u32(2);
        }
    }
    else
    {
        introducing_0 = _S67;
        roots_0 = _S66;
    }
    var _S71 : u32 = mask_count_0(introducing_0) + mask_count_0(roots_0);
    traversed_count_0 = _S71;
    if(_S71 > u32(64))
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
        var _S72 : vec2<u32> = mask_below_0(t_2);
        var place_1 : u32 = mask_count_0((introducing_0 & (_S72))) + mask_count_0((roots_0 & (_S72)));
        var triangle_0 : u32 = packed_triangle_0(t_2);
        var place_2 : u32;
        if(mask_test_0(roots_0, t_2))
        {
            var b_0 : u32 = (((triangle_0 >> (u32(8)))) & (u32(255)));
            team_traversal_0[(place_1 & (u32(63)))] = pack4_0(b_0, b_0, (triangle_0 & (u32(255))), b_0);
            place_2 = place_1 + u32(1);
        }
        else
        {
            place_2 = place_1;
        }
        if(mask_test_0(introducing_0, t_2))
        {
            team_traversal_0[(place_2 & (u32(63)))] = triangle_0;
        }
        t_2 = t_2 + u32(32);
    }
    return;
}

fn is_packed_0( s_9 : u32) -> bool
{
    var _S73 : u32 = (extractBits((shared_places_0[s_9]), u32((i32(28))), u32((i32(2)))));
    return _S73 <= u32(2);
}

fn word_of_0( s_10 : u32,  id_0 : u32) -> u32
{
    var _S74 : u32 = (extractBits((shared_places_0[s_10]), u32((i32(0))), u32((i32(16)))));
    var _S75 : u32 = (extractBits((shared_places_0[s_10]), u32((i32(16))), u32((i32(6)))));
    return _S74 + _S75 * ((id_0 & (u32(63))));
}

fn vertex_at_0( s_11 : u32,  id_1 : u32) -> vec2<u32>
{
    var word_1 : u32 = word_of_0(s_11, id_1);
    var _S76 : u32 = (extractBits((shared_places_0[s_11]), u32((i32(28))), u32((i32(2)))));
    if(_S76 == u32(1))
    {
        return vec2<u32>(all_values_0[the_values_0 + word_1], u32(0));
    }
    var _S77 : u32 = u32(2) * ((word_1 >> (u32(1))));
    return vec2<u32>(all_values_0[the_values_0 + _S77], all_values_0[the_values_0 + _S77 + u32(1)]);
}

fn value_element_0( s_12 : u32,  c_0 : u32) -> u32
{
    var _S78 : u32 = (extractBits((shared_stream_0[s_12]), u32((i32(12))), u32((i32(11)))));
    var element_2 : u32 = _S78 + c_0;
    var _S79 : u32;
    if(element_2 < u32(20))
    {
        _S79 = element_2;
    }
    else
    {
        _S79 = u32(0);
    }
    return _S79 * u32(64);
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

fn value_at_0( s_13 : u32,  c_1 : u32,  id_2 : u32) -> u32
{
    var _S80 : bool = is_packed_0(s_13);
    if(_S80)
    {
        var _S81 : vec2<u32> = vertex_at_0(s_13, id_2);
        var _S82 : u32 = (extractBits((shared_places_0[s_13]), u32((i32(22))), u32((i32(6)))));
        var _S83 : u32 = c_1 * _S82;
        var _S84 : u32 = (extractBits((shared_places_0[s_13]), u32((i32(22))), u32((i32(6)))));
        return get_field_0(_S81, _S83, _S84);
    }
    var _S85 : u32 = the_values_0;
    var _S86 : u32 = word_of_0(s_13, id_2);
    return all_values_0[_S85 + (_S86 + c_1)];
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
        var s_14 : u32 = u32(0);
        for(;;)
        {
            if(s_14 < stream_end_0)
            {
            }
            else
            {
                break;
            }
            var _S87 : bool = is_packed_0(s_14);
            var _S88 : vec2<u32>;
            if(_S87)
            {
                var _S89 : vec2<u32> = vertex_at_0(s_14, id_3);
                _S88 = _S89;
            }
            else
            {
                _S88 = vec2<u32>(u32(0));
            }
            var _S90 : u32 = (extractBits((shared_places_0[s_14]), u32((i32(22))), u32((i32(6)))));
            var c_2 : u32 = u32(0);
            for(;;)
            {
                var _S91 : u32 = (extractBits((shared_stream_0[s_14]), u32((i32(0))), u32((i32(3)))));
                if(c_2 < _S91)
                {
                }
                else
                {
                    break;
                }
                var _S92 : u32 = value_element_0(s_14, c_2);
                var _S93 : bool = is_packed_0(s_14);
                var _S94 : u32;
                if(_S93)
                {
                    _S94 = get_field_0(_S88, c_2 * _S90, _S90);
                }
                else
                {
                    var _S95 : u32 = value_at_0(s_14, c_2, id_3);
                    _S94 = _S95;
                }
                team_values_0[_S92 + id_3] = _S94;
                c_2 = c_2 + u32(1);
            }
            s_14 = s_14 + u32(1);
        }
        id_3 = id_3 + u32(32);
    }
    return;
}

fn listed_streams_0( s_15 : u32,  end_2 : u32) -> u32
{
    var next_0 : u32 = s_15;
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
        var _S96 : bool;
        if(next_0 > s_15)
        {
            _S96 = elements_1 > u32(4);
        }
        else
        {
            _S96 = false;
        }
        if(_S96)
        {
            break;
        }
        next_0 = next_0 + u32(1);
        elements_0 = elements_1;
    }
    return next_0;
}

fn interior_code_of_0( s_16 : u32) -> u32
{
    return ((team_codes_0[s_16]) & (u32(255)));
}

fn reference_length_of_0( r_2 : u32) -> u32
{
    return ((team_references_0[(r_2 & (u32(63)))]) >> (u32(8)));
}

fn seam_vertices_of_0( s_17 : u32) -> u32
{
    var rest_3 : vec2<u32> = team_seam_refs_0[s_17];
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
    var s_18 : u32 = begin_2;
    var ones_0 : u32 = u32(0);
    for(;;)
    {
        if(s_18 < end_3)
        {
        }
        else
        {
            break;
        }
        if((interior_code_of_0(s_18)) != u32(255))
        {
            var _S97 : u32 = traversed_count_0 + seam_vertices_of_0(s_18);
            var _S98 : u32 = (extractBits((shared_stream_0[s_18]), u32((i32(0))), u32((i32(3)))));
            ones_0 = ones_0 + _S97 * _S98;
        }
        s_18 = s_18 + u32(1);
    }
    return ones_0;
}

var<workgroup> team_scratch_0 : array<atomic<u32>, i32(256)>;

fn list_ones_0( p_15 : u32,  n_4 : u32)
{
    var word_2 : u32;
    var before_3 : u32;
    var _S99 : u32 = (p_15 >> (u32(5)));
    var empty_0 : u32 = u32(0);
    var found_0 : u32 = u32(0);
    var w_1 : u32 = _S99;
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
            var _S100 : bool;
            if(k_1 < u32(32))
            {
                _S100 = found_1 < n_4;
            }
            else
            {
                _S100 = false;
            }
            if(_S100)
            {
            }
            else
            {
                break;
            }
            var _S101 : u32 = w_1 + k_1;
            var word_3 : u32 = load_word_0(_S101);
            if(_S101 == _S99)
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
            var _S102 : u32 = k_1 + u32(1);
            empty_0 = before_3;
            k_1 = _S102;
            found_1 = found_2;
        }
        var _S103 : bool;
        if(w_1 >= (push_0.blob_words_0))
        {
            _S103 = true;
        }
        else
        {
            _S103 = empty_0 > u32(543);
        }
        if(_S103)
        {
            error_0 = u32(8);
            return;
        }
        word_2 = mine_0;
        before_3 = before_4;
        for(;;)
        {
            var _S104 : bool;
            if(word_2 != u32(0))
            {
                _S104 = before_3 < n_4;
            }
            else
            {
                _S104 = false;
            }
            if(_S104)
            {
            }
            else
            {
                break;
            }
            atomicStore(&(team_scratch_0[before_3]), (((w_1 + the_thread_0) << (u32(5)))) + firstbitlow_0(word_2));
            var mine_1 : u32 = (word_2 & ((word_2 - u32(1))));
            var _S105 : u32 = before_3 + u32(1);
            word_2 = mine_1;
            before_3 = _S105;
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
    var _S106 : u32 = n_5;
    var w_4 : u32 = w_3;
    var word_5 : u32 = word_4;
    for(;;)
    {
        if(ones_1 < _S106)
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
        var _S107 : bool;
        if(w_4 >= (push_0.blob_words_0))
        {
            _S107 = true;
        }
        else
        {
            _S107 = empty_1 > u32(512);
        }
        if(_S107)
        {
            error_0 = u32(8);
            return p_16;
        }
        var _S108 : u32 = _S106 - ones_1;
        var w_5 : u32 = w_4 + u32(1);
        var word_6 : u32 = load_word_0(w_5);
        ones_1 = countOneBits(word_6);
        _S106 = _S108;
        w_4 = w_5;
        word_5 = word_6;
    }
    ones_1 = _S106;
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

fn interior_widths_of_0( s_19 : u32) -> u32
{
    return team_codes_begin_0 + (((team_codes_0[s_19]) >> (u32(8))));
}

var<workgroup> team_seams_0 : array<u32, i32(64)>;

fn loop_id_0( rank_2 : u32) -> u32
{
    var _S109 : u32 = atomicLoad(&(team_loop_0[(((rank_2 >> (u32(2)))) & (u32(15)))]));
    var _S110 : u32 = (extractBits((_S109), u32((i32((rank_2 & (u32(3)))) * i32(8))), u32((i32(6)))));
    return _S110;
}

fn list_seams_0( s_20 : u32) -> u32
{
    var rest_4 : vec2<u32> = team_seam_refs_0[s_20];
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
        var _S111 : u32 = ((team_references_0[r_3]) & (u32(63)));
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
            var _S112 : u32 = loop_id_0(_S111 + i_9);
            team_seams_0[((count_7 + i_9 - u32(1)) & (u32(63)))] = (((_S112 | (((r_3 << (u32(8))))))) | (((i_9 << (u32(16))))));
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
    var _S113 : u32;
    if(w_6 == u32(31))
    {
        _S113 = u32(32);
    }
    else
    {
        _S113 = w_6;
    }
    return _S113;
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
    var _S114 : bool;
    if(q_0 <= u32(31))
    {
        _S114 = (parameter_0 + q_0) <= u32(32);
    }
    else
    {
        _S114 = false;
    }
    if(_S114)
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
    var _S115 : u32;
    if(exponential_0)
    {
        var _S116 : u32 = exponential_quotient_0(k_2, q_1);
        _S115 = _S116;
    }
    else
    {
        _S115 = q_1;
    }
    var width_1 : u32;
    if(exponential_0)
    {
        width_1 = k_2 + _S115;
    }
    else
    {
        width_1 = k_2;
    }
    var bits_4 : u32 = load_bits_0((*low_1), width_1);
    (*low_1) = (*low_1) + width_1;
    if(exponential_0)
    {
        _S115 = ((u32(1) << (_S115))) - u32(1);
    }
    return ((_S115 << (k_2))) + bits_4;
}

fn unzigzag_0( u_0 : u32) -> u32
{
    return (((u_0 >> (u32(1)))) ^ ((u32(0) - ((u_0 & (u32(1)))))));
}

fn read_interior_residuals_0( s_21 : u32,  code_3 : u32,  widths_2 : u32,  low_2 : u32,  seams_2 : u32,  count_9 : u32,  ones_2 : u32,  unary_begin_0 : u32)
{
    var n_6 : u32 = (extractBits((shared_stream_0[s_21]), u32((i32(0))), u32((i32(3)))));
    var _S117 : bool = code_3 == u32(255);
    var _S118 : u32;
    if(_S117)
    {
        _S118 = fixed_width_0(n_6, widths_2);
    }
    else
    {
        _S118 = u32(0);
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
                var _S119 : u32 = item_0 / n_6;
                i_10 = _S119;
            }
        }
        var c_4 : u32 = item_0 - i_10 * n_6;
        var _S120 : u32;
        if(i_10 < seams_2)
        {
            _S120 = team_seams_0[(i_10 & (u32(63)))];
        }
        else
        {
            _S120 = ((team_traversal_0[((i_10 - seams_2) & (u32(63)))]) >> (u32(16)));
        }
        var id_4 : u32 = (_S120 & (u32(63)));
        var residual_0 : u32;
        if(_S117)
        {
            residual_0 = load_bits_0(low_2 + i_10 * _S118 + fixed_width_0(c_4, widths_2), width_field_0(widths_2 + u32(5) * c_4));
        }
        else
        {
            if(item_0 == u32(0))
            {
                residual_0 = unary_begin_0;
            }
            else
            {
                var _S121 : u32 = atomicLoad(&(team_scratch_0[ones_2 + item_0 - u32(1)]));
                residual_0 = _S121 + u32(1);
            }
            var _S122 : u32 = atomicLoad(&(team_scratch_0[ones_2 + item_0]));
            var quotient_0 : u32 = _S122 - residual_0;
            if(quotient_0 > u32(16383))
            {
                error_0 = u32(8);
            }
            var at_1 : u32;
            var _S123 : u32 = low_2 + item_0 * ((code_3 & (u32(31))));
            var _S124 : u32;
            if(is_exponential_0(code_3))
            {
                _S124 = residual_0 - unary_begin_0 - item_0;
            }
            else
            {
                _S124 = u32(0);
            }
            at_1 = _S123 + _S124;
            var _S125 : u32 = coded_value_0(code_3, quotient_0, &(at_1));
            residual_0 = _S125;
        }
        var _S126 : u32 = value_element_0(s_21, c_4);
        team_values_0[_S126 + id_4] = unzigzag_0(residual_0);
        item_0 = item_0 + u32(32);
    }
    return;
}

fn low_size_0( code_4 : u32,  elements_3 : u32,  widths_3 : u32,  n_7 : u32,  zeros_0 : u32) -> u32
{
    if(code_4 == u32(255))
    {
        var _S127 : u32 = n_7 / elements_3;
        return _S127 * fixed_width_0(elements_3, widths_3);
    }
    var _S128 : u32 = n_7 * ((code_4 & (u32(31))));
    var _S129 : u32;
    if(is_exponential_0(code_4))
    {
        _S129 = zeros_0;
    }
    else
    {
        _S129 = u32(0);
    }
    return _S128 + _S129;
}

fn read_interior_0( sound_0 : bool)
{
    var _S130 : bool;
    var p_17 : u32 = team_interior_0;
    var phase_0 : u32 = u32(0);
    for(;;)
    {
        var _S131 : bool;
        if(phase_0 < u32(2))
        {
            _S131 = phase_0 < (push_0.streams_0);
        }
        else
        {
            _S131 = false;
        }
        if(_S131)
        {
        }
        else
        {
            break;
        }
        var next_list_0 : u32 = phase_0;
        var p_18 : u32 = p_17;
        var ones_3 : u32 = u32(0);
        var s_22 : u32 = phase_0;
        var listed_0 : u32 = u32(0);
        var low_3 : u32 = p_17;
        for(;;)
        {
            var _S132 : bool = phase_0 == u32(0);
            var _S133 : u32;
            if(_S132)
            {
                _S133 = u32(1);
            }
            else
            {
                _S133 = push_0.streams_0;
            }
            if(s_22 < _S133)
            {
            }
            else
            {
                break;
            }
            var n_8 : u32 = (extractBits((shared_stream_0[s_22]), u32((i32(0))), u32((i32(3)))));
            workgroupBarrier();
            var listed_1 : u32;
            var seams_3 : u32;
            var low_4 : u32;
            var count_10 : u32;
            if(s_22 == next_list_0)
            {
                if(_S132)
                {
                    listed_1 = u32(1);
                }
                else
                {
                    listed_1 = push_0.streams_0;
                }
                var next_list_1 : u32 = listed_streams_0(s_22, listed_1);
                if(sound_0)
                {
                    var _S134 : u32 = interior_ones_0(s_22, next_list_1);
                    seams_3 = min(_S134, u32(256));
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
                if(s_22 == phase_0)
                {
                    _S130 = sound_0;
                }
                else
                {
                    _S130 = false;
                }
                if(_S130)
                {
                    if(seams_3 > u32(0))
                    {
                        var _S135 : u32 = atomicLoad(&(team_scratch_0[seams_3 - u32(1)]));
                        low_4 = _S135 + u32(1);
                    }
                    else
                    {
                        low_4 = p_18;
                    }
                    if(_S132)
                    {
                        count_10 = u32(1);
                    }
                    else
                    {
                        count_10 = stream_total_0;
                    }
                    var _S136 : u32 = interior_ones_0(next_list_1, count_10);
                    var _S137 : u32 = after_ones_0(low_4, _S136);
                    low_4 = _S137;
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
            var code_5 : u32 = interior_code_of_0(s_22);
            var widths_4 : u32 = interior_widths_of_0(s_22);
            if(sound_0)
            {
                var _S138 : u32 = list_seams_0(s_22);
                seams_3 = _S138;
            }
            else
            {
                seams_3 = u32(0);
            }
            if(sound_0)
            {
                _S130 = error_0 == u32(0);
            }
            else
            {
                _S130 = false;
            }
            if(_S130)
            {
                count_10 = min(seams_3 + traversed_count_0, u32(64)) * n_8;
            }
            else
            {
                count_10 = u32(0);
            }
            var _S139 : bool = code_5 != u32(255);
            var count_11 : u32;
            if(_S139)
            {
                count_11 = min(count_10, ones_3 - listed_1);
            }
            else
            {
                count_11 = count_10;
            }
            workgroupBarrier();
            read_interior_residuals_0(s_22, code_5, widths_4, low_4, seams_3, count_11, listed_1, p_18);
            var _S140 : bool;
            if(_S139)
            {
                _S140 = count_11 > u32(0);
            }
            else
            {
                _S140 = false;
            }
            var next_1 : u32;
            if(_S140)
            {
                var listed_2 : u32 = listed_1 + count_11;
                var _S141 : u32 = atomicLoad(&(team_scratch_0[listed_2 - u32(1)]));
                next_1 = _S141 + u32(1);
                listed_0 = listed_2;
            }
            else
            {
                next_1 = p_18;
                listed_0 = listed_1;
            }
            var _S142 : u32 = low_size_0(code_5, n_8, widths_4, count_11, next_1 - p_18 - count_11);
            var low_5 : u32 = low_4 + _S142;
            var _S143 : u32 = s_22 + u32(1);
            p_18 = next_1;
            s_22 = _S143;
            low_3 = low_5;
        }
        if(sound_0)
        {
            _S130 = (max(p_18, low_3)) > (u32(8) * (byte_length_0 - u32(8)));
        }
        else
        {
            _S130 = false;
        }
        if(_S130)
        {
            error_0 = u32(8);
        }
        var _S144 : u32 = phase_0 + u32(1);
        p_17 = low_3;
        phase_0 = _S144;
    }
    workgroupBarrier();
    return;
}

fn agree_0() -> bool
{
    if(error_0 != u32(0))
    {
        var _S145 : u32 = atomicMax(&(team_error_0), error_0);
    }
    workgroupBarrier();
    var _S146 : u32 = atomicLoad(&(team_error_0));
    error_0 = _S146;
    return _S146 == u32(0);
}

fn any_stream_predicts_0( predictors_0 : u32) -> bool
{
    var s_23 : u32 = u32(0);
    var found_3 : u32 = u32(0);
    for(;;)
    {
        if(s_23 < (push_0.streams_0))
        {
        }
        else
        {
            break;
        }
        var found_4 : u32 = (found_3 | (((u32(1) << (((the_blob_0[u32(8) + u32(7) * s_23] >> (u32(24)))))))));
        s_23 = s_23 + u32(1);
        found_3 = found_4;
    }
    return ((found_3 & (predictors_0))) != u32(0);
}

fn excess_0( x_1 : u32,  y_1 : u32) -> u32
{
    var _S147 : u32;
    if(x_1 > y_1)
    {
        _S147 = x_1 - y_1;
    }
    else
    {
        _S147 = u32(0);
    }
    return _S147;
}

fn geo_shift_0() -> u32
{
    var _S148 : u32 = (extractBits((shared_stream_0[u32(0)]), u32((i32(3))), u32((i32(6)))));
    return excess_0(_S148, u32(13));
}

struct Triple_0
{
     x_2 : u32,
     y_2 : u32,
     z_1 : u32,
};

fn Triple_x24init_0( x_3 : u32,  y_3 : u32,  z_2 : u32) -> Triple_0
{
    var _S149 : Triple_0;
    _S149.x_2 = x_3;
    _S149.y_2 = y_3;
    _S149.z_1 = z_2;
    return _S149;
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
    var _S150 : Triple_0 = v_1;
    _S150.x_2 = shift_right_0(_S150.x_2, n_10);
    _S150.y_2 = shift_right_0(_S150.y_2, n_10);
    _S150.z_1 = shift_right_0(_S150.z_1, n_10);
    return _S150;
}

fn difference_0( to_0 : Triple_0,  from_0 : Triple_0) -> Triple_0
{
    var _S151 : Triple_0 = to_0;
    _S151.x_2 = _S151.x_2 - from_0.x_2;
    _S151.y_2 = _S151.y_2 - from_0.y_2;
    _S151.z_1 = _S151.z_1 - from_0.z_1;
    return _S151;
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
        var _S152 : bool;
        if(t_4 < triangle_count_0)
        {
            _S152 = sound_1;
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
        var triangle_2 : u32 = packed_triangle_0(t_4);
        var _S153 : u32 = geo_shift_0();
        var _S154 : Triple_0 = triangle_normal_0(triangle_2, _S153);
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
            var place_3 : u32 = u32(3) * ((((triangle_2 >> ((u32(8) * corner_0)))) & (u32(63))));
            var _S155 : u32 = atomicAdd(&(team_scratch_0[place_3]), _S154.x_2);
            var _S156 : u32 = atomicAdd(&(team_scratch_0[place_3 + u32(1)]), _S154.y_2);
            var _S157 : u32 = atomicAdd(&(team_scratch_0[place_3 + u32(2)]), _S154.z_1);
            corner_0 = corner_0 + u32(1);
        }
        t_4 = t_4 + u32(32);
    }
    workgroupBarrier();
    return;
}

fn magnitude_0( x_5 : u32) -> u32
{
    var _S158 : u32;
    if(i32(x_5) < i32(0))
    {
        _S158 = u32(0) - x_5;
    }
    else
    {
        _S158 = x_5;
    }
    return _S158;
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
    var _S159 : u32 = (limit_0 >> (u32(1)));
    q_2.u_1 = _S159;
    q_2.v_3 = _S159;
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
    var _S160 : u32 = u32(2) * sum_2;
    var _S161 : u32 = (u_2 * limit_0 + sum_2) / _S160;
    q_2.u_1 = _S161;
    var _S162 : u32 = (v_4 * limit_0 + sum_2) / _S160;
    q_2.v_3 = _S162;
    return q_2;
}

fn bits_mask_0( s_24 : u32) -> u32
{
    var _S163 : u32 = (extractBits((shared_stream_0[s_24]), u32((i32(3))), u32((i32(6)))));
    return word_below_0(_S163);
}

fn predict_team_geo_0( s_25 : u32)
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
        var place_4 : u32 = u32(3) * id_6;
        var _S164 : u32 = atomicLoad(&(team_scratch_0[place_4]));
        var _S165 : u32 = atomicLoad(&(team_scratch_0[place_4 + u32(1)]));
        var _S166 : u32 = atomicLoad(&(team_scratch_0[place_4 + u32(2)]));
        var _S167 : u32 = (extractBits((shared_stream_0[s_25]), u32((i32(3))), u32((i32(6)))));
        var _S168 : OctPair_0 = octahedral_prediction_0(_S164, _S165, _S166, (_S167 & (u32(31))));
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
            var _S169 : u32 = value_element_0(s_25, c_5);
            var _S170 : u32;
            if(c_5 == u32(0))
            {
                _S170 = _S168.u_1;
            }
            else
            {
                _S170 = _S168.v_3;
            }
            var _S171 : u32 = _S170 + team_values_0[_S169 + id_6];
            var _S172 : u32 = bits_mask_0(s_25);
            team_values_0[_S169 + id_6] = (_S171 & (_S172));
            c_5 = c_5 + u32(1);
        }
        i_12 = i_12 + u32(32);
    }
    return;
}

fn runs_backwards_0( h_4 : Header_0,  r_4 : u32,  s_26 : u32) -> bool
{
    return mask_test_0(((h_4.foreign_refs_1) & ((~team_seam_refs_0[s_26]))), r_4);
}

fn mask_msb_0( m_8 : vec2<u32>) -> u32
{
    var _S173 : u32 = m_8.y;
    var _S174 : u32;
    if(_S173 != u32(0))
    {
        _S174 = u32(32) + firstbithigh_0(_S173);
    }
    else
    {
        var _S175 : u32 = m_8.x;
        if(_S175 != u32(0))
        {
            _S174 = firstbithigh_0(_S175);
        }
        else
        {
            _S174 = u32(64);
        }
    }
    return _S174;
}

fn loop_begin_0( h_5 : Header_0,  r_5 : u32) -> u32
{
    var before_5 : vec2<u32> = ((h_5.loop_ends_2) & ((mask_below_0(r_5))));
    var _S176 : u32;
    if(mask_any_0(before_5))
    {
        _S176 = mask_msb_0(before_5) + u32(1);
    }
    else
    {
        _S176 = u32(0);
    }
    return _S176;
}

fn next_reference_0( h_6 : Header_0,  r_6 : u32) -> u32
{
    var _S177 : u32;
    if(mask_test_0(h_6.loop_ends_2, r_6))
    {
        _S177 = loop_begin_0(h_6, r_6);
    }
    else
    {
        _S177 = r_6 + u32(1);
    }
    return _S177;
}

fn first_id_0( r_7 : u32) -> u32
{
    var _S178 : u32 = loop_id_0(team_references_0[(r_7 & (u32(63)))]);
    return _S178;
}

fn run_id_0( h_7 : Header_0,  r_8 : u32,  backwards_0 : bool,  i_13 : u32) -> u32
{
    var length_1 : u32 = reference_length_of_0(r_8);
    var place_5 : u32;
    if(backwards_0)
    {
        place_5 = length_1 - i_13;
    }
    else
    {
        place_5 = i_13;
    }
    if(place_5 == length_1)
    {
        var _S179 : u32 = first_id_0(next_reference_0(h_7, r_8));
        return _S179;
    }
    var _S180 : u32 = loop_id_0((((team_references_0[(r_8 & (u32(63)))]) & (u32(63)))) + place_5);
    return _S180;
}

fn chain_step_of_0( h_8 : Header_0,  s_27 : u32,  item_1 : u32,  step_0 : ptr<function, u32>) -> bool
{
    var r_9 : u32 = ((mask_count_0((team_ranks_0 & ((mask_below_0(item_1 + u32(1)))))) - u32(1)) & (u32(63)));
    var length_2 : u32 = reference_length_of_0(r_9);
    var backwards_1 : bool = runs_backwards_0(h_8, r_9, s_27);
    var i_14 : u32 = item_1 - (((team_references_0[r_9]) & (u32(63))));
    (*step_0) = u32(4278190080);
    var _S181 : bool;
    if(i_14 == u32(0))
    {
        _S181 = true;
    }
    else
    {
        _S181 = i_14 >= length_2;
    }
    if(_S181)
    {
        _S181 = true;
    }
    else
    {
        _S181 = mask_test_0(h_8.private_refs_1, r_9);
    }
    if(_S181)
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
    var _S182 : u32 = run_id_0(h_8, r_9, backwards_1, i_15);
    var _S183 : u32 = run_id_0(h_8, r_9, backwards_1, i_15 - u32(1));
    var _S184 : u32 = run_id_0(h_8, r_9, backwards_1, length_2);
    if(i_15 < u32(2))
    {
        i_15 = u32(255);
    }
    else
    {
        var _S185 : u32 = run_id_0(h_8, r_9, backwards_1, i_15 - u32(2));
        i_15 = _S185;
    }
    (*step_0) = pack4_0(_S182, _S183, _S184, i_15);
    return true;
}

fn dot3_0( v_5 : Triple_0,  w_7 : Triple_0) -> u32
{
    return v_5.x_2 * w_7.x_2 + v_5.y_2 * w_7.y_2 + v_5.z_1 * w_7.z_1;
}

fn signed_quotient_0( x_8 : u32,  d_0 : u32) -> u32
{
    var quotient_1 : u32 = magnitude_0(x_8) / d_0;
    var _S186 : u32;
    if(i32(x_8) < i32(0))
    {
        _S186 = u32(0) - quotient_1;
    }
    else
    {
        _S186 = quotient_1;
    }
    return _S186;
}

struct Weights_0
{
     exist_0 : bool,
     s_28 : u32,
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
    var _S187 : bool;
    if(i32(determinant_0) > ((i32(product_0) >> (u32(5)))))
    {
        _S187 = d_1 != u32(0);
    }
    else
    {
        _S187 = false;
    }
    w_8.exist_0 = _S187;
    w_8.s_28 = u32(0);
    w_8.u_3 = u32(0);
    if(!_S187)
    {
        return w_8;
    }
    var _S188 : u32 = signed_quotient_0(re_1 * ff_1 - rf_1 * ef_0, d_1);
    w_8.s_28 = _S188;
    var _S189 : u32 = signed_quotient_0(rf_1 * ee_1 - re_1 * ef_0, d_1);
    w_8.u_3 = _S189;
    if((magnitude_0(_S188)) < u32(1024))
    {
        _S187 = (magnitude_0(w_8.u_3)) < u32(1024);
    }
    else
    {
        _S187 = false;
    }
    w_8.exist_0 = _S187;
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
    var _S190 : i32 = i32(ee_2);
    var _S191 : bool;
    if(_S190 > i32(0))
    {
        _S191 = i32(re_2) >= i32(0);
    }
    else
    {
        _S191 = false;
    }
    if(_S191)
    {
        _S191 = i32(re_2) <= _S190;
    }
    else
    {
        _S191 = false;
    }
    w_9.exist_0 = _S191;
    w_9.s_28 = u32(0);
    w_9.u_3 = u32(0);
    if(_S191)
    {
        var _S192 : u32 = (re_2 * u32(256) + ((ee_2 >> (u32(1))))) / ee_2;
        w_9.s_28 = _S192;
    }
    return w_9;
}

fn pack_weights_0( w_10 : Weights_0) -> u32
{
    var _S193 : u32;
    if(w_10.exist_0)
    {
        _S193 = ((((((w_10.s_28) & (u32(4095)))) | ((((((w_10.u_3) & (u32(4095)))) << (u32(12))))))) | (u32(2147483648)));
    }
    else
    {
        _S193 = u32(0);
    }
    return _S193;
}

fn find_weights_0( h_11 : Header_0,  s_29 : u32,  chains_2 : bool)
{
    var _S194 : u32;
    if(chains_2)
    {
        if((h_11.references_1) > u32(0))
        {
            _S194 = mask_count_0(team_boundary_0);
        }
        else
        {
            _S194 = u32(0);
        }
    }
    else
    {
        _S194 = traversed_count_0;
    }
    var item_2 : u32 = the_thread_0;
    for(;;)
    {
        if(item_2 < _S194)
        {
        }
        else
        {
            break;
        }
        var _S195 : u32 = (item_2 & (u32(63)));
        var step_1 : u32 = ((((((((team_traversal_0[_S195]) >> (u32(16)))) & (u32(255)))) | ((((((team_traversal_0[_S195]) & (u32(65535)))) << (u32(8))))))) | ((((team_traversal_0[_S195]) & (u32(4278190080))))));
        var _S196 : bool;
        if(chains_2)
        {
            var _S197 : bool = chain_step_of_0(h_11, s_29, item_2, &(step_1));
            _S196 = !_S197;
        }
        else
        {
            _S196 = false;
        }
        if(_S196)
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
            var _S198 : Weights_0 = affine_weights_0(a_4, b_3, (((step_1 >> (u32(24)))) & (u32(63))), v_8);
            w_11 = _S198;
        }
        var _S199 : bool;
        if(chains_2)
        {
            _S199 = !w_11.exist_0;
        }
        else
        {
            _S199 = false;
        }
        if(_S199)
        {
            var _S200 : Weights_0 = line_weights_0(a_4, b_3, v_8);
            w_11 = _S200;
        }
        team_seams_0[_S195] = pack_weights_0(w_11);
        item_2 = item_2 + u32(32);
    }
    return;
}

fn element_total_0() -> u32
{
    var _S201 : u32 = (extractBits((shared_stream_0[stream_end_0 - u32(1)]), u32((i32(12))), u32((i32(11)))));
    var _S202 : u32 = (extractBits((shared_stream_0[stream_end_0 - u32(1)]), u32((i32(0))), u32((i32(3)))));
    return min(_S201 + _S202, u32(20));
}

fn stream_of_element_0( element_3 : u32) -> vec2<u32>
{
    var s_30 : u32 = u32(0);
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
        var _S203 : u32 = (extractBits((shared_stream_0[next_2]), u32((i32(12))), u32((i32(11)))));
        if(element_3 >= _S203)
        {
            s_30 = next_2;
        }
        next_2 = next_2 + u32(1);
    }
    var _S204 : u32 = (extractBits((shared_stream_0[s_30]), u32((i32(12))), u32((i32(11)))));
    return vec2<u32>(s_30, element_3 - _S204);
}

fn Weights_x24init_0( exist_1 : bool,  s_31 : u32,  u_4 : u32) -> Weights_0
{
    var _S205 : Weights_0;
    _S205.exist_0 = exist_1;
    _S205.s_28 = s_31;
    _S205.u_3 = u_4;
    return _S205;
}

fn unpack_weights_0( word_8 : u32) -> Weights_0
{
    var _S206 : i32 = i32(word_8);
    var _S207 : i32 = (extractBits((_S206), u32((i32(0))), u32((i32(12)))));
    var _S208 : u32 = u32(_S207);
    var _S209 : i32 = (extractBits((_S206), u32((i32(12))), u32((i32(12)))));
    return Weights_x24init_0(true, _S208, u32(_S209));
}

fn affine_point_0( w_12 : Weights_0,  a_5 : u32,  b_4 : u32,  o_1 : u32) -> u32
{
    return a_5 + shift_right_0(w_12.s_28 * (b_4 - a_5) + w_12.u_3 * (o_1 - a_5) + u32(128), u32(8));
}

fn divide_0( x_9 : u32,  n_14 : u32) -> u32
{
    var _S210 : u32 = x_9 / n_14;
    return _S210;
}

fn toward_0( a_6 : u32,  b_5 : u32,  n_15 : u32) -> u32
{
    var _S211 : u32 = divide_0(b_5 - a_6 + ((n_15 >> (u32(1)))) + ((n_15 << (u32(24)))), n_15);
    return a_6 + _S211 - u32(16777216);
}

fn predict_chain_0( h_12 : Header_0,  r_13 : u32,  s_32 : u32,  element_4 : u32)
{
    var _S212 : u32 = (extractBits((shared_stream_0[s_32]), u32((i32(9))), u32((i32(3)))));
    var base_3 : u32 = min(element_4, u32(19)) * u32(64);
    var _S213 : u32 = bits_mask_0(s_32);
    var length_3 : u32 = reference_length_of_0(r_13);
    var backwards_2 : bool = runs_backwards_0(h_12, r_13, s_32);
    var rank_3 : u32 = ((team_references_0[(r_13 & (u32(63)))]) & (u32(63)));
    var to_1 : u32 = first_id_0(next_reference_0(h_12, r_13));
    var prev_0 : u32;
    if(backwards_2)
    {
        prev_0 = to_1;
    }
    else
    {
        var _S214 : u32 = loop_id_0(rank_3);
        prev_0 = _S214;
    }
    var prev_1 : u32 = team_values_0[base_3 + prev_0];
    if(backwards_2)
    {
        var _S215 : u32 = loop_id_0(rank_3);
        prev_0 = _S215;
    }
    else
    {
        prev_0 = to_1;
    }
    var _S216 : u32 = team_values_0[base_3 + prev_0];
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
        var _S217 : u32;
        if(backwards_2)
        {
            _S217 = left_0 - u32(1);
        }
        else
        {
            _S217 = length_3 + u32(1) - left_0;
        }
        var place_6 : u32 = rank_3 + _S217;
        var _S218 : u32 = loop_id_0(place_6);
        var v_9 : u32 = base_3 + _S218;
        var weights_0 : u32;
        if(_S212 == u32(5))
        {
            weights_0 = team_seams_0[(place_6 & (u32(63)))];
        }
        else
        {
            weights_0 = u32(0);
        }
        var point_0 : u32;
        if(weights_0 != u32(0))
        {
            var _S219 : Weights_0 = unpack_weights_0(weights_0);
            point_0 = affine_point_0(_S219, prev_0, _S216, before_6);
        }
        else
        {
            if(_S212 != u32(2))
            {
                var _S220 : u32 = toward_0(prev_0, _S216, left_0);
                point_0 = _S220;
            }
            else
            {
                point_0 = prev_0;
            }
        }
        var prev_2 : u32 = ((point_0 + team_values_0[v_9]) & (_S213));
        team_values_0[v_9] = prev_2;
        var _S221 : u32 = left_0 - u32(1);
        before_6 = prev_0;
        prev_0 = prev_2;
        left_0 = _S221;
    }
    return;
}

fn predict_chains_0( h_13 : Header_0,  s_33 : u32,  only_seams_0 : bool)
{
    var one_0 : bool = s_33 < u32(8);
    var _S222 : u32;
    if(one_0)
    {
        var _S223 : u32 = (extractBits((shared_stream_0[s_33]), u32((i32(12))), u32((i32(11)))));
        _S222 = _S223;
    }
    else
    {
        _S222 = u32(0);
    }
    var item_3 : u32;
    if(one_0)
    {
        var _S224 : u32 = (extractBits((shared_stream_0[s_33]), u32((i32(0))), u32((i32(3)))));
        item_3 = _S224;
    }
    else
    {
        var _S225 : u32 = element_total_0();
        item_3 = _S225;
    }
    var _S226 : u32 = max(item_3, u32(1));
    item_3 = the_thread_0;
    for(;;)
    {
        if(item_3 < (h_13.references_1 * _S226))
        {
        }
        else
        {
            break;
        }
        var r_14 : u32 = item_3 / _S226;
        var element_5 : u32 = _S222 + item_3 - r_14 * _S226;
        var of_0 : u32;
        if(one_0)
        {
            of_0 = s_33;
        }
        else
        {
            var _S227 : vec2<u32> = stream_of_element_0(element_5);
            of_0 = _S227.x;
        }
        if(mask_test_0(h_13.private_refs_1, r_14))
        {
            item_3 = item_3 + u32(32);
            continue;
        }
        var _S228 : bool;
        if(!one_0)
        {
            var _S229 : u32 = (extractBits((shared_stream_0[of_0]), u32((i32(9))), u32((i32(3)))));
            _S228 = _S229 == u32(5);
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
        var _S230 : bool;
        if(only_seams_0)
        {
            _S230 = !mask_test_0(team_seam_refs_0[of_0], r_14);
        }
        else
        {
            _S230 = false;
        }
        if(_S230)
        {
            item_3 = item_3 + u32(32);
            continue;
        }
        predict_chain_0(h_13, r_14, of_0, element_5);
        item_3 = item_3 + u32(32);
    }
    return;
}

fn predict_element_0( s_34 : u32,  c_6 : u32)
{
    var predictor_0 : u32 = (extractBits((shared_stream_0[s_34]), u32((i32(9))), u32((i32(3)))));
    var _S231 : u32 = bits_mask_0(s_34);
    var _S232 : u32 = value_element_0(s_34, c_6);
    var copies_0 : bool = predictor_0 == u32(2);
    var damped_0 : bool = predictor_0 == u32(3);
    var _S233 : bool = predictor_0 == u32(5);
    var _S234 : bool;
    if(predictor_0 != u32(1))
    {
        _S234 = !copies_0;
    }
    else
    {
        _S234 = false;
    }
    var _S235 : u32;
    if(damped_0)
    {
        _S235 = u32(3);
    }
    else
    {
        _S235 = u32(1);
    }
    var _S236 : u32;
    if(damped_0)
    {
        _S236 = u32(4294967294);
    }
    else
    {
        _S236 = u32(4294967295);
    }
    var _S237 : u32;
    if(damped_0)
    {
        _S237 = u32(2);
    }
    else
    {
        _S237 = u32(0);
    }
    var _S238 : i32;
    if(damped_0)
    {
        _S238 = i32(2);
    }
    else
    {
        _S238 = i32(0);
    }
    var _S239 : i32;
    if(copies_0)
    {
        _S239 = i32(0);
    }
    else
    {
        _S239 = i32(1);
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
        var _S240 : u32 = (extractBits((team_traversal_0[i_16]), u32((i32(16))), u32((i32(6)))));
        var residual_1 : u32 = team_values_0[_S232 + _S240];
        var a_7 : u32 = team_values_0[_S232 + ((triangle_3 & (u32(63))))];
        var _S241 : u32 = (extractBits((triangle_3), u32((i32(8))), u32((i32(6)))));
        var b_6 : u32 = team_values_0[_S232 + _S241];
        var _S242 : u32 = (extractBits((triangle_3), u32((i32(24))), u32((i32(6)))));
        var o_2 : u32 = team_values_0[_S232 + _S242];
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
        if(_S234)
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
            point_1 = _S235 * sum_3 + _S236 * o_2 + _S237;
        }
        else
        {
            point_1 = sum_3;
        }
        var _S243 : i32 = i32(point_1);
        var _S244 : i32;
        if(across_0)
        {
            _S244 = _S238;
        }
        else
        {
            _S244 = _S239;
        }
        var _S245 : u32 = u32((_S243 >> (u32(_S244))));
        var point_2 : u32;
        if(_S233)
        {
            var weights_1 : u32 = team_seams_0[i_16];
            if((team_seams_0[i_16]) != u32(0))
            {
                var _S246 : Weights_0 = unpack_weights_0(weights_1);
                point_2 = affine_point_0(_S246, a_7, b_6, o_2);
            }
            else
            {
                point_2 = _S245;
            }
        }
        else
        {
            point_2 = _S245;
        }
        team_values_0[_S232 + _S240] = ((point_2 + residual_1) & (_S231));
        i_16 = i_16 + u32(1);
    }
    return;
}

fn predict_0( h_14 : Header_0,  sound_2 : bool,  only_seams_1 : bool,  has_chains_0 : bool)
{
    var geo_0 : bool = any_stream_predicts_0(u32(16));
    var affine_0 : bool = any_stream_predicts_0(u32(32));
    var traversal_0 : u32 = push_0.streams_0 + u32(1);
    var _S247 : bool;
    if(geo_0)
    {
        _S247 = true;
    }
    else
    {
        _S247 = affine_0;
    }
    var _S248 : u32;
    if(_S247)
    {
        _S248 = traversal_0 + u32(1);
    }
    else
    {
        _S248 = traversal_0;
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
        if(step_2 <= _S248)
        {
        }
        else
        {
            break;
        }
        var chains_3 : bool = step_2 < traversal_0;
        if(chains_3)
        {
            _S247 = step_2 > u32(0);
        }
        else
        {
            _S247 = false;
        }
        var s_35 : u32;
        if(_S247)
        {
            s_35 = step_2 - u32(1);
        }
        else
        {
            s_35 = u32(8);
        }
        var _S249 : bool = s_35 < u32(8);
        var _S250 : bool;
        if(_S249)
        {
            _S250 = ((the_blob_0[u32(8) + u32(7) * s_35] >> (u32(24)))) != u32(5);
        }
        else
        {
            _S250 = false;
        }
        if(_S250)
        {
            step_2 = step_2 + u32(1);
            continue;
        }
        workgroupBarrier();
        var after_0 : bool = step_2 > traversal_0;
        var _S251 : bool;
        if(after_0)
        {
            _S251 = geo_0;
        }
        else
        {
            _S251 = false;
        }
        if(_S251)
        {
            sum_team_normals_0(sound_2);
        }
        var of_1 : u32 = u32(0);
        for(;;)
        {
            var _S252 : bool;
            if(of_1 < stream_end_0)
            {
                _S252 = after_0;
            }
            else
            {
                _S252 = false;
            }
            var _S253 : bool;
            if(_S252)
            {
                _S253 = sound_2;
            }
            else
            {
                _S253 = false;
            }
            if(_S253)
            {
            }
            else
            {
                break;
            }
            var _S254 : u32 = (extractBits((shared_stream_0[of_1]), u32((i32(9))), u32((i32(3)))));
            if(_S254 == u32(4))
            {
                predict_team_geo_0(of_1);
            }
            of_1 = of_1 + u32(1);
        }
        var _S255 : bool;
        if(after_0)
        {
            _S255 = affine_0;
        }
        else
        {
            _S255 = _S249;
        }
        if(_S255)
        {
            if(sound_2)
            {
                find_weights_0(h_14, s_35, chains_3);
            }
            workgroupBarrier();
        }
        var _S256 : bool;
        if(chains_3)
        {
            _S256 = sound_2;
        }
        else
        {
            _S256 = false;
        }
        if(_S256)
        {
            predict_chains_0(h_14, s_35, only_seams_1);
        }
        var element_6 : u32 = the_thread_0;
        for(;;)
        {
            var _S257 : u32 = element_total_0();
            var _S258 : bool;
            if(element_6 < _S257)
            {
                _S258 = !chains_3;
            }
            else
            {
                _S258 = false;
            }
            var _S259 : bool;
            if(_S258)
            {
                _S259 = sound_2;
            }
            else
            {
                _S259 = false;
            }
            if(_S259)
            {
            }
            else
            {
                break;
            }
            var of_2 : vec2<u32> = stream_of_element_0(element_6);
            var _S260 : u32 = of_2.x;
            var predictor_1 : u32 = (extractBits((shared_stream_0[_S260]), u32((i32(9))), u32((i32(3)))));
            var _S261 : bool;
            if(after_0)
            {
                _S261 = predictor_1 == u32(5);
            }
            else
            {
                _S261 = predictor_1 < u32(4);
            }
            if(_S261)
            {
                predict_element_0(_S260, of_2.y);
            }
            element_6 = element_6 + u32(32);
        }
        step_2 = step_2 + u32(1);
    }
    return;
}

fn put_field_0( at_2 : u32,  value_3 : u32) -> vec2<u32>
{
    var _S262 : vec2<u32>;
    if(at_2 < u32(32))
    {
        _S262 = vec2<u32>((value_3 << (at_2)), (((value_3 >> (u32(1)))) >> ((u32(31) - at_2))));
    }
    else
    {
        _S262 = vec2<u32>(u32(0), (value_3 << ((at_2 - u32(32)))));
    }
    return _S262;
}

fn put_vertex_0( s_36 : u32,  id_7 : u32,  fields_2 : vec2<u32>)
{
    var word_9 : u32 = word_of_0(s_36, id_7);
    var _S263 : u32 = (extractBits((shared_places_0[s_36]), u32((i32(28))), u32((i32(2)))));
    if(_S263 == u32(1))
    {
        all_values_0[the_values_0 + word_9] = fields_2.x;
    }
    else
    {
        var _S264 : u32 = u32(2) * ((word_9 >> (u32(1))));
        all_values_0[the_values_0 + _S264] = fields_2.x;
        all_values_0[the_values_0 + _S264 + u32(1)] = fields_2.y;
    }
    return;
}

fn put_value_0( s_37 : u32,  c_7 : u32,  id_8 : u32,  value_4 : u32)
{
    var _S265 : u32 = bits_mask_0(s_37);
    var inside_0 : u32 = (value_4 & (_S265));
    var _S266 : bool = is_packed_0(s_37);
    if(!_S266)
    {
        var _S267 : u32 = the_values_0;
        var _S268 : u32 = word_of_0(s_37, id_8);
        all_values_0[_S267 + (_S268 + c_7)] = inside_0;
        return;
    }
    var before_7 : vec2<u32>;
    if(c_7 == u32(0))
    {
        before_7 = vec2<u32>(u32(0));
    }
    else
    {
        var _S269 : vec2<u32> = vertex_at_0(s_37, id_8);
        before_7 = _S269;
    }
    var _S270 : u32 = (extractBits((shared_places_0[s_37]), u32((i32(22))), u32((i32(6)))));
    put_vertex_0(s_37, id_8, (before_7 | ((put_field_0(c_7 * _S270, inside_0)))));
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
        var s_38 : u32 = u32(0);
        for(;;)
        {
            if(s_38 < stream_end_0)
            {
            }
            else
            {
                break;
            }
            var _S271 : vec2<u32> = vec2<u32>(u32(0));
            var c_8 : u32 = u32(0);
            var fields_3 : vec2<u32> = _S271;
            for(;;)
            {
                var _S272 : u32 = (extractBits((shared_stream_0[s_38]), u32((i32(0))), u32((i32(3)))));
                if(c_8 < _S272)
                {
                }
                else
                {
                    break;
                }
                var _S273 : u32 = value_element_0(s_38, c_8);
                var value_5 : u32 = team_values_0[_S273 + id_9];
                var _S274 : bool = is_packed_0(s_38);
                if(_S274)
                {
                    var _S275 : u32 = (extractBits((shared_places_0[s_38]), u32((i32(22))), u32((i32(6)))));
                    fields_3 = (fields_3 | ((put_field_0(c_8 * _S275, value_5))));
                }
                else
                {
                    put_value_0(s_38, c_8, id_9, value_5);
                }
                c_8 = c_8 + u32(1);
            }
            var _S276 : bool = is_packed_0(s_38);
            if(_S276)
            {
                put_vertex_0(s_38, id_9, fields_3);
            }
            s_38 = s_38 + u32(1);
        }
        id_9 = id_9 + u32(32);
    }
    return;
}

fn interior_shader_0()
{
    open_job_0(push_0.first_0 + the_workgroup_0.x);
    var summary_0 : u32 = atomicLoad(&(the_summaries_0[job_place_0]));
    var places_0 : Places_std430_0 = all_places_0[job_meshlet_0];
    var _S277 : bool;
    if(((summary_0 >> (u32(16)))) == u32(0))
    {
        _S277 = (places_0.interior_0) != u32(4294967295);
    }
    else
    {
        _S277 = false;
    }
    var live_0 : u32;
    if(_S277)
    {
        live_0 = u32(1);
    }
    else
    {
        live_0 = u32(0);
    }
    var _S278 : u32 = (extractBits((places_0.counts_0), u32((i32(13))), u32((i32(3)))));
    var state_0 : u32 = uniform_word_0((live_0 | (((_S278 << (u32(1)))))));
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
    var s_39 : u32 = the_thread_0;
    for(;;)
    {
        if(s_39 < stream_total_0)
        {
        }
        else
        {
            break;
        }
        team_seam_refs_0[s_39] = mask_none_0();
        s_39 = s_39 + u32(32);
    }
    var _S279 : u32 = (extractBits((places_0.counts_0), u32((i32(7))), u32((i32(6)))));
    read_interior_codes_0(places_0.codes_0, mask_any_0(((mask_below_0(_S279)) & ((~(((places_0.foreign_refs_0) | ((places_0.private_refs_0)))))))));
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
        var _S280 : Header_0 = find_seams_of_0();
        h_15 = _S280;
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
        var _S281 : vec2<u32>;
        if((h_15.flags_0) != u32(0))
        {
            _S281 = mask_none_0();
        }
        else
        {
            _S281 = (team_boundary_0 & ((~places_0.waiting_0)));
        }
        store_values_0(_S281);
    }
    else
    {
        if(the_thread_0 == u32(0))
        {
            var _S282 : u32 = atomicOr(&(the_summaries_0[job_place_0]), (error_0 << (u32(16))));
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

