# Sets the compile options of a target. Third-party headers come in as SYSTEM (imported targets).
# TEST: the target is compiled quickly rather than for speed. The libraries that it tests keep their options.
# UNITY: the compiler reads sixteen files at once, for headers and Eigen's templates take most of the time. Each file still
# includes the headers that it uses: the preset `tidy` compiles them one by one.
function(palpate_target name)
  cmake_parse_arguments(arg "TEST;UNITY" "" "" ${ARGN})
  if(arg_TEST)
    target_compile_options(${name} PRIVATE "$<$<CONFIG:Release>:-O1;-g0>")
  elseif(arg_UNITY)
    # Eigen's templates compile a tenth faster than with -O3 and run as fast. The runtime keeps -O3.
    target_compile_options(${name} PRIVATE "$<$<CONFIG:Release>:-O2>")
  endif()
  if(arg_UNITY)
    set_target_properties(${name} PROPERTIES UNITY_BUILD ${PALPATE_UNITY} UNITY_BUILD_BATCH_SIZE 16)
  endif()
  target_compile_options(${name} PRIVATE
    -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Wdouble-promotion -Werror
    # A product and a sum are contracted to one rounding only where the code says fma: the same source then gives
    # the same bits at any optimisation level, which replay and byte-identical packs rest on.
    -ffp-contract=off)
  if(NOT PALPATE_SIMD)
    target_compile_definitions(${name} PRIVATE PALPATE_SCALAR_ONLY)
  endif()
  if(PALPATE_SANITIZE)
    target_compile_options(${name} PRIVATE -fsanitize=address,undefined -fno-sanitize-recover=undefined
                           -fno-omit-frame-pointer)
    if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
      # GCC's documentation warns that instrumented code gives false positives of this warning.
      target_compile_options(${name} PRIVATE -Wno-maybe-uninitialized)
    endif()
    target_link_options(${name} PRIVATE -fsanitize=address,undefined)
  endif()
  if(PALPATE_FUZZ)
    target_compile_options(${name} PRIVATE -fsanitize=fuzzer-no-link)
  endif()
endfunction()
