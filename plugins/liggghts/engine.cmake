# LIGGGHTS-PUBLIC 3.8.0 as a library, compiled from LIGGGHTS_SOURCE_DIR: for machines without Debian's library, and for groups with styles
# of their own in their source tree, which is only read. Without VTK: dumps in its formats are not in the library.
set(version none)
if(EXISTS "${LIGGGHTS_SOURCE_DIR}/version_liggghts.txt")
  file(STRINGS "${LIGGGHTS_SOURCE_DIR}/version_liggghts.txt" version LIMIT_COUNT 1)
endif()
if(NOT version STREQUAL "3.8.0" OR NOT EXISTS "${LIGGGHTS_SOURCE_DIR}/Make.sh")
  set(wrong "${LIGGGHTS_SOURCE_DIR}")
  unset(LIGGGHTS_SOURCE_DIR CACHE)  # for the next time
  message(FATAL_ERROR "LIGGGHTS_SRC=${wrong} is not the folder src of LIGGGHTS-PUBLIC 3.8.0 (version found: ${version})")
endif()

set(LIGGGHTS_INCLUDE_DIR ${CMAKE_CURRENT_BINARY_DIR}/engine)
file(GLOB tree CONFIGURE_DEPENDS ${LIGGGHTS_SOURCE_DIR}/*.cpp ${LIGGGHTS_SOURCE_DIR}/*.h ${LIGGGHTS_SOURCE_DIR}/*.whitelist
     ${LIGGGHTS_SOURCE_DIR}/version_*.txt ${LIGGGHTS_SOURCE_DIR}/Make.sh)
list(FILTER tree EXCLUDE REGEX "/(main|dump_mesh_vtk|utils|finish)\\.(cpp|h)$|/style_[a-z_]*\\.h$|/version_liggghts\\.h$")
list(APPEND tree ${LIGGGHTS_SOURCE_DIR}/finish.h)
file(COPY ${tree} DESTINATION ${LIGGGHTS_INCLUDE_DIR})

# As published in 2017, two lines are no C++17: a stream that converts to its base, and a pointer compared with a number.
function(mend name old new)
  file(READ ${LIGGGHTS_SOURCE_DIR}/${name} text)
  string(REPLACE "${old}" "${new}" text "${text}")
  file(CONFIGURE OUTPUT ${LIGGGHTS_INCLUDE_DIR}/${name} CONTENT "${text}" @ONLY)
endfunction()
mend(utils.h "static_cast< std::ostringstream & >(( std::ostringstream() << std::dec << a ) ).str()" "std::to_string(a)")
mend(finish.cpp "neighbor->lists[m]->numneigh > 0" "neighbor->lists[m]->numneigh")

# The tree's own script writes the lists of styles and of combinations of contact models; a `style_contact_model.whitelist` in the tree
# names the combinations to compile.
foreach(kind style models)
  execute_process(COMMAND bash Make.sh ${kind} WORKING_DIRECTORY ${LIGGGHTS_INCLUDE_DIR} RESULT_VARIABLE failed OUTPUT_VARIABLE said
                  ERROR_VARIABLE said)
  if(failed)
    message(FATAL_ERROR "LIGGGHTS's Make.sh ${kind} failed: ${said}")
  endif()
endforeach()
# Headers of the tree include the lists of contact models. A list in the folder of these headers would be found first, before that of our
# program: the tree's own lists get a folder of their own.
set(models ${CMAKE_CURRENT_BINARY_DIR}/engine_lists)
file(MAKE_DIRECTORY ${models})
foreach(kind surface normal tangential cohesion rolling)
  file(COPY_FILE ${LIGGGHTS_INCLUDE_DIR}/style_${kind}_model.h ${models}/style_${kind}_model.h ONLY_IF_DIFFERENT)
  file(REMOVE ${LIGGGHTS_INCLUDE_DIR}/style_${kind}_model.h)
endforeach()

file(GLOB engine ${LIGGGHTS_INCLUDE_DIR}/*.cpp)
add_library(liggghts SHARED ${engine})
target_include_directories(liggghts PRIVATE ${LIGGGHTS_INCLUDE_DIR} ${models})
target_link_libraries(liggghts PRIVATE MPI::MPI_CXX)
# Its own options; the code is not ours to warn about.
target_compile_options(liggghts PRIVATE -O2 -funroll-loops -fstrict-aliasing -w)
set(LIGGGHTS_LIBRARY liggghts)
install(TARGETS liggghts COMPONENT engines)
