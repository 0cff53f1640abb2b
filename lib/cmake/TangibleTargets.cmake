# Targets: one static library a module (a folder), programs, tests, benchmarks.
include(GNUInstallDirs)

# Headers are included as "tangible/<module>/<file>.h", in the tree as once installed: a folder of
# links in the build tree gives each module its installed name.
set(TANGIBLE_INCLUDE_DIR "${PROJECT_BINARY_DIR}/include")
file(MAKE_DIRECTORY "${TANGIBLE_INCLUDE_DIR}/tangible/config")
file(CREATE_LINK "${PROJECT_SOURCE_DIR}/lib/tangible.h" "${TANGIBLE_INCLUDE_DIR}/tangible/tangible.h" SYMBOLIC)

# The scalar list: a macro that applies X to each Jet width.
set(TANGIBLE_JET_LIST "")
foreach(width IN LISTS TANGIBLE_JET_WIDTHS)
  string(APPEND TANGIBLE_JET_LIST " X(${width})")
endforeach()
# The local width: one contact, joint or force reads at most 16 numbers (two poses and 10 others).
set(TANGIBLE_LOCAL_JET_WIDTH 16)
set(TANGIBLE_JET_AND_LOCAL_LIST "")
set(jet_and_local_widths ${TANGIBLE_JET_WIDTHS} ${TANGIBLE_LOCAL_JET_WIDTH})
list(REMOVE_DUPLICATES jet_and_local_widths)
foreach(width IN LISTS jet_and_local_widths)
  string(APPEND TANGIBLE_JET_AND_LOCAL_LIST " X(${width})")
endforeach()
configure_file("${PROJECT_SOURCE_DIR}/lib/cmake/jet_widths.h.in"
               "${TANGIBLE_INCLUDE_DIR}/tangible/config/jet_widths.h" @ONLY)

add_library(tangible_flags INTERFACE)
target_compile_options(tangible_flags INTERFACE -Wall -Wextra -Wpedantic -ffp-contract=off)
# The Python package links the engine into a shared library. As an option, and not by CMake's property: programs then
# have the same one as libraries, and share their precompiled header.
target_compile_options(tangible_flags INTERFACE -fPIC)
# Functions of the engine are not replaced by others of their name when it is linked into a shared library.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(tangible_flags INTERFACE -fno-semantic-interposition)
endif()
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 13)
  # False alarms of g++ 12 on `"literal" + std::string` (GCC bug 105651), which a precompiled header no longer hides as
  # system headers'.
  target_compile_options(tangible_flags INTERFACE -Wno-restrict -Wno-stringop-overflow
                         -Wno-stringop-overread -Wno-array-bounds)
endif()
if(TANGIBLE_WARNINGS_AS_ERRORS)
  target_compile_options(tangible_flags INTERFACE -Werror)
endif()
if(TANGIBLE_UNITY AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  # Several sources at once need much memory: a compiler that collects it only where its share of the machine's is used
  # takes a tenth less time.
  cmake_host_system_information(RESULT memory QUERY TOTAL_PHYSICAL_MEMORY)
  cmake_host_system_information(RESULT cores QUERY NUMBER_OF_LOGICAL_CORES)
  math(EXPR share "1024 * ${memory} / (4 * ${cores})")
  target_compile_options(tangible_flags INTERFACE --param=ggc-min-heapsize=${share})
endif()
if(TANGIBLE_POISON)
  target_compile_definitions(tangible_flags INTERFACE TANGIBLE_POISON EIGEN_INITIALIZE_MATRICES_BY_NAN)
endif()
if(TANGIBLE_SANITIZE)
  # Each reference and each address has a check of its own that it is not null and is aligned: half of the code, and a
  # third of its compilation. What is null is found when it is read or written.
  target_compile_options(tangible_flags INTERFACE -fsanitize=address,undefined -fno-sanitize=null,alignment
                         -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(tangible_flags INTERFACE -fsanitize=address,undefined)
  # The sanitizer's allocator hands out other alignments than Debian's Ceres was built for.
  target_compile_definitions(tangible_flags INTERFACE EIGEN_MALLOC_ALREADY_ALIGNED=1)
endif()

if(TANGIBLE_FUZZ)
  if(NOT CMAKE_CXX_COMPILER_ID STREQUAL "Clang")
    message(FATAL_ERROR "TANGIBLE_FUZZ: expected clang, got ${CMAKE_CXX_COMPILER_ID}")
  endif()
  target_compile_options(tangible_flags INTERFACE -fsanitize=fuzzer-no-link,address,undefined
                         -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(tangible_flags INTERFACE -fsanitize=address,undefined)
  target_compile_definitions(tangible_flags INTERFACE EIGEN_MALLOC_ALREADY_ALIGNED=1)
endif()

# One precompiled header for all targets: most files read Eigen and ceres/jet.h, two seconds each.
if(TANGIBLE_PRECOMPILE_HEADERS)
  # CONFIGURE leaves a file alone that has this content, so that configuring again rebuilds nothing.
  file(CONFIGURE OUTPUT "${PROJECT_BINARY_DIR}/precompiled.cc" CONTENT "// Carries the precompiled header.\n")
  add_library(tangible_precompiled OBJECT "${PROJECT_BINARY_DIR}/precompiled.cc")
  target_compile_features(tangible_precompiled PRIVATE cxx_std_20)
  target_link_libraries(tangible_precompiled PRIVATE tangible_flags Eigen3::Eigen)
  target_precompile_headers(tangible_precompiled PRIVATE
    <ceres/jet.h> <Eigen/Core> <Eigen/LU> <Eigen/QR> <algorithm> <cmath> <functional> <map> <memory>
    <optional> <random> <sstream> <string> <utility> <vector>)
endif()
function(tangible_precompile target)
  if(TANGIBLE_PRECOMPILE_HEADERS)
    target_precompile_headers(${target} REUSE_FROM tangible_precompiled)
  endif()
endfunction()

# With TANGIBLE_UNITY up to sixteen sources of a target are compiled as one.
function(tangible_unite target)
  get_target_property(sources ${target} SOURCES)
  list(FILTER sources INCLUDE REGEX "\\.cc$")
  list(LENGTH sources num_sources)
  if(TANGIBLE_UNITY AND num_sources GREATER 1)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_BATCH_SIZE 16
      UNITY_BUILD_CODE_BEFORE_INCLUDE "#undef TANGIBLE_INSTANTIATE\n#undef TANGIBLE_INSTANTIATE_JET")
  endif()
endfunction()

# What reads, writes, draws and compares, and does not compute for long: with -O1 it compiles in half of the time of -O3
# (sources of lib/scene: 24 s for 48).
function(tangible_compile_quickly target)
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1>)
endfunction()

# Everything that the tests labelled unit or program need, and nothing else.
add_custom_target(tangible_unit_and_program_tests)

# A name of a target from that of a module: lcp/dense becomes lcp_dense.
function(tangible_target_name name result)
  string(REPLACE "/" "_" target "${name}")
  set(${result} ${target} PARENT_SCOPE)
endfunction()

# tangible_module_folder(<name>): headers of the current folder are included as "tangible/<name>/...".
function(tangible_module_folder name)
  file(CREATE_LINK "${CMAKE_CURRENT_SOURCE_DIR}" "${TANGIBLE_INCLUDE_DIR}/tangible/${name}" SYMBOLIC)
endfunction()

# tangible_module(<name> [INTERNAL] [NO_PRECOMPILE] [QUICK] [SOURCES file...] [HEADERS file...] [DEPENDS module...]
#                 [LINK target...])
# The library of the current folder. A name is `scene` or, for a sub-folder, `lcp/dense`: target
# tangible_lcp_dense, alias tangible::lcp_dense. A module without sources is an INTERFACE library.
# DEPENDS is the only way to the symbols of another module's headers. INTERNAL modules are not installed.
# NO_PRECOMPILE: what it links brings compiler options of its own. QUICK: see tangible_compile_quickly.
function(tangible_module name)
  cmake_parse_arguments(MODULE "INTERNAL;NO_PRECOMPILE;QUICK" "" "SOURCES;HEADERS;DEPENDS;LINK;PRIVATE_LINK" ${ARGN})
  tangible_target_name(${name} short_name)
  if(NOT name MATCHES "/")
    tangible_module_folder(${name})
  endif()
  set(target tangible_${short_name})
  if(MODULE_SOURCES)
    add_library(${target} STATIC ${MODULE_SOURCES} ${MODULE_HEADERS})
    set(scope PUBLIC)
    target_link_libraries(${target} PRIVATE $<BUILD_INTERFACE:tangible_flags> ${MODULE_PRIVATE_LINK})
    if(NOT MODULE_NO_PRECOMPILE)
      tangible_precompile(${target})
    endif()
    if(MODULE_QUICK)
      tangible_compile_quickly(${target})
    endif()
    add_dependencies(tangible_unit_and_program_tests ${target})
    tangible_unite(${target})
  else()
    add_library(${target} INTERFACE)
    set(scope INTERFACE)
  endif()
  add_library(tangible::${short_name} ALIAS ${target})
  set_target_properties(${target} PROPERTIES EXPORT_NAME ${short_name})
  target_compile_features(${target} ${scope} cxx_std_20)
  target_include_directories(${target} ${scope} $<BUILD_INTERFACE:${TANGIBLE_INCLUDE_DIR}>
                             $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  foreach(module IN LISTS MODULE_DEPENDS)
    tangible_target_name(${module} dependency)
    target_link_libraries(${target} ${scope} tangible_${dependency})
  endforeach()
  target_link_libraries(${target} ${scope} ${MODULE_LINK})
  if(MODULE_INTERNAL)
    return()
  endif()
  install(TARGETS ${target} EXPORT tangible_targets)
  foreach(header IN LISTS MODULE_HEADERS)
    install(FILES "${header}" DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/tangible/${name}")
  endforeach()
endfunction()

# tangible_module_group(<name> sub-folder...): tangible_<name> stands for all of its sub-folders' modules.
function(tangible_module_group name)
  add_library(tangible_${name} INTERFACE)
  add_library(tangible::${name} ALIAS tangible_${name})
  set_target_properties(tangible_${name} PROPERTIES EXPORT_NAME ${name})
  foreach(folder IN LISTS ARGN)
    target_link_libraries(tangible_${name} INTERFACE tangible_${name}_${folder})
  endforeach()
  install(TARGETS tangible_${name} EXPORT tangible_targets)
endfunction()

# tangible_program(<name> [NO_PRECOMPILE] SOURCES file... LINK target...): an installed program.
function(tangible_program name)
  cmake_parse_arguments(PROGRAM "NO_PRECOMPILE" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${PROGRAM_SOURCES})
  target_link_libraries(${name} PRIVATE tangible_flags ${PROGRAM_LINK})
  tangible_unite(${name})
  if(NOT PROGRAM_NO_PRECOMPILE)
    tangible_precompile(${name})
  endif()
  # Those of verification come with the tests that run them; under the sanitizers others are not built.
  set(optional)
  if(NOT CMAKE_CURRENT_SOURCE_DIR MATCHES "/verification/")
    add_dependencies(tangible_unit_and_program_tests ${name})
    tangible_compile_quickly(${name})
  elseif(TANGIBLE_SANITIZE)
    set(optional OPTIONAL)
  endif()
  target_compile_definitions(${name} PRIVATE TANGIBLE_VERSION="${PROJECT_VERSION}")
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/bin")
  install(TARGETS ${name} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} ${optional})
endfunction()

# Tests assert more than they compute: with -O1 they compile in two thirds of the time. To be linked after
# tangible_flags, whose options they change.
add_library(tangible_test_flags INTERFACE)
target_compile_options(tangible_test_flags INTERFACE $<$<CONFIG:Release>:-O1>)

# tangible_test(<name> [NO_PRECOMPILE] [BY_FILE prefix] SOURCES file... LINK target... [LABELS label...]
#               [TIMEOUT seconds]): a program of tests. The tests of a folder are one program, but for those that are
# labelled otherwise or count allocations, and one entry of ctest; BY_FILE: an entry for each file, <prefix>_<file>, for
# files that take long, which then run beside each other although they are compiled at once. NO_PRECOMPILE: what it
# links brings compiler options of its own.
function(tangible_test name)
  cmake_parse_arguments(TEST "NO_PRECOMPILE" "BY_FILE;TIMEOUT" "SOURCES;LINK;LABELS" ${ARGN})
  add_executable(${name} ${TEST_SOURCES})
  if(TEST_BY_FILE)
    target_sources(${name} PRIVATE "${PROJECT_SOURCE_DIR}/tests/support/main_by_file.cc")
  endif()
  target_link_libraries(${name} PRIVATE tangible_flags tangible_test_flags ${TEST_LINK}
                                        GTest::$<IF:$<BOOL:${TEST_BY_FILE}>,gtest,gtest_main>)
  tangible_unite(${name})
  if(TANGIBLE_PRECOMPILE_HEADERS AND NOT TEST_NO_PRECOMPILE)
    target_precompile_headers(${name} REUSE_FROM tangible_precompiled_tests)
  endif()
  if("unit" IN_LIST TEST_LABELS OR "program" IN_LIST TEST_LABELS)
    add_dependencies(tangible_unit_and_program_tests ${name})
  endif()
  target_compile_definitions(${name} PRIVATE TANGIBLE_SOURCE_DIR="${PROJECT_SOURCE_DIR}"
                             TANGIBLE_PROGRAM_DIR="${PROJECT_BINARY_DIR}/bin")
  if(NOT TEST_TIMEOUT)
    set(TEST_TIMEOUT 300)
  endif()
  set(entries)
  if(TEST_BY_FILE)
    foreach(source IN LISTS TEST_SOURCES)
      get_filename_component(stem "${source}" NAME_WE)
      add_test(NAME ${TEST_BY_FILE}_${stem} COMMAND ${name} --file=${stem}.cc)
      list(APPEND entries ${TEST_BY_FILE}_${stem})
    endforeach()
  else()
    add_test(NAME ${name} COMMAND ${name})
    set(entries ${name})
  endif()
  set_tests_properties(${entries} PROPERTIES LABELS "${TEST_LABELS}" TIMEOUT ${TEST_TIMEOUT})
endfunction()

# tangible_thorough(<entry> COMMAND word...): the tests of an entry at their full size (tests/support/thorough.h).
function(tangible_thorough entry)
  cmake_parse_arguments(THOROUGH "" "" "COMMAND" ${ARGN})
  add_test(NAME ${entry}_thorough COMMAND ${THOROUGH_COMMAND})
  set_tests_properties(${entry}_thorough PROPERTIES LABELS slow TIMEOUT 3600 ENVIRONMENT "TANGIBLE_THOROUGH=1")
endfunction()

# tangible_benchmark(<name> SOURCES file... LINK target...): a Google Benchmark program, not a test.
function(tangible_benchmark name)
  cmake_parse_arguments(BENCHMARK "" "" "SOURCES;LINK" ${ARGN})
  if(NOT TANGIBLE_BUILD_BENCHMARKS)
    return()
  endif()
  find_package(benchmark REQUIRED)
  add_executable(${name} ${BENCHMARK_SOURCES})
  target_link_libraries(${name} PRIVATE tangible_flags ${BENCHMARK_LINK} benchmark::benchmark_main)
  tangible_unite(${name})
  tangible_precompile(${name})
  target_compile_definitions(${name} PRIVATE TANGIBLE_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/benchmarks")
endfunction()
