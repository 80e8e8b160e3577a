# Adds meshoptimizer's simplifier, with the guard of simplifier_guard.h, to a target.

# Replaces a text that must be there once: a new version of meshoptimizer needs a look at the guard.
function(insert_once variable mark text)
  string(FIND "${${variable}}" "${mark}" first)
  string(FIND "${${variable}}" "${mark}" last REVERSE)
  if(first EQUAL -1 OR NOT first EQUAL last)
    message(FATAL_ERROR "simplifier.cpp has no place, or several, for the guard: ${mark}")
  endif()
  string(REPLACE "${mark}" "${text}" changed "${${variable}}")
  set(${variable} "${changed}" PARENT_SCOPE)
endfunction()

function(add_simplifier target folder)
  file(READ ${folder}/simplifier.cpp source)
  insert_once(source "static bool hasTriangleFlips("
    "#include \"simplifier_guard.h\"\n\nstatic bool hasTriangleFlips(")
  insert_once(source "if (a == i1 || b == i1 || a == b)\n\t\t\tcontinue;\n"
    "if (a == i1 || b == i1 || a == b)\n\t\t\tcontinue;\n\n\t\tif (guardRefuses(vertex_positions, a, b, i0, i1))\n\t\t\treturn true;\n")
  insert_once(source "\t// build position remap that maps each vertex to the one with identical position\n\tunsigned int* remap = allocator.allocate<unsigned int>(vertex_count);\n\tunsigned int* wedge"
    "\tguard.sparse_remap = sparse_remap;\n\n\tunsigned int* remap = allocator.allocate<unsigned int>(vertex_count);\n\tunsigned int* wedge")
  set(guarded ${CMAKE_CURRENT_BINARY_DIR}/simplifier.cpp)
  file(CONFIGURE OUTPUT ${guarded} CONTENT "${source}" @ONLY)
  set(sources ${guarded} ${folder}/allocator.cpp ${folder}/partition.cpp)
  target_sources(${target} PRIVATE ${sources})
  # As the codec: levels would differ on processors that fuse multiplications and additions.
  set_source_files_properties(${sources} PROPERTIES
    COMPILE_OPTIONS "-O3;-ffp-contract=off;-Wno-unused-function;-I${folder};-I${CMAKE_CURRENT_SOURCE_DIR}/cmake;-include;${CMAKE_CURRENT_SOURCE_DIR}/cmake/simplifier.h"
    OBJECT_DEPENDS "${CMAKE_CURRENT_SOURCE_DIR}/cmake/simplifier_guard.h")
endfunction()
