# Installs the build tree BINARY_DIR into a prefix of its own, then configures, builds and runs the
# project SOURCE_DIR against it. WORK_DIR is emptied first.
#   cmake -DBINARY_DIR=... -DSOURCE_DIR=... -DWORK_DIR=... -DBUILD_TYPE=... -DCXX=... -DCXX_FLAGS=... -P ...

# run(<command>...): fails the test with the command's output unless it succeeds.
function(run)
  execute_process(COMMAND ${ARGV} RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL 0)
    list(JOIN ARGV " " command)
    message(FATAL_ERROR "${command}\nexit status ${result}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

file(REMOVE_RECURSE "${WORK_DIR}")
set(prefix "${WORK_DIR}/prefix")
run("${CMAKE_COMMAND}" --install "${BINARY_DIR}" --prefix "${prefix}")

# Every installed header must find all that it includes.
set(includes "// SPDX-License-Identifier: Apache-2.0\n")
file(GLOB_RECURSE headers RELATIVE "${prefix}/include" "${prefix}/include/tangible/*.h")
list(SORT headers)
foreach(header IN LISTS headers)
  string(APPEND includes "#include \"${header}\"\n")
endforeach()
file(WRITE "${WORK_DIR}/all_headers.cc" "${includes}")

# The README's program in C++ is built and run too, from the top of the tree.
cmake_path(GET SOURCE_DIR PARENT_PATH top)
cmake_path(GET top PARENT_PATH top)
cmake_path(GET top PARENT_PATH top)
file(READ "${top}/README.md" readme)
string(REGEX MATCH "```cpp\n([^`]*)```" block "${readme}")
set(program "${CMAKE_MATCH_1}")
string(REGEX MATCH "// (-[^\n]*)\n" comment "${program}")
set(printed "${CMAKE_MATCH_1}")
file(WRITE "${WORK_DIR}/readme.cc" "${program}")

run("${CMAKE_COMMAND}" -S "${SOURCE_DIR}" -B "${WORK_DIR}/build" -G Ninja "-DCMAKE_PREFIX_PATH=${prefix}"
    "-DCONSUMER_MORE_SOURCES=${WORK_DIR}/all_headers.cc" "-DREADME_SOURCE=${WORK_DIR}/readme.cc"
    "-DCMAKE_BUILD_TYPE=${BUILD_TYPE}" "-DCMAKE_CXX_COMPILER=${CXX}" "-DCMAKE_CXX_FLAGS=${CXX_FLAGS}")
run("${CMAKE_COMMAND}" --build "${WORK_DIR}/build")
run("${WORK_DIR}/build/consumer")
message(STATUS "${output}")
run("${CMAKE_COMMAND}" -E chdir "${top}" "${WORK_DIR}/build/readme")
string(STRIP "${output}" output)
if(printed STREQUAL "" OR NOT output STREQUAL printed)
  message(FATAL_ERROR "README.md: its program in C++ prints '${output}', and its comment says '${printed}'")
endif()

# Nothing that is installed may point back into the trees it came from.
file(GLOB_RECURSE configs "${prefix}/lib*/cmake/*.cmake")
list(LENGTH configs num_configs)
if(num_configs LESS 3)
  message(FATAL_ERROR "expected the package's config, version and targets files, got: ${configs}")
endif()
foreach(config IN LISTS configs)
  file(READ "${config}" text)
  foreach(tree IN ITEMS "${BINARY_DIR}" "${SOURCE_DIR}")
    string(FIND "${text}" "${tree}" at)
    if(NOT at EQUAL -1)
      message(FATAL_ERROR "${config} names ${tree}")
    endif()
  endforeach()
endforeach()
