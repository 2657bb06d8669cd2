# What a build of the fuzzers is made with, everywhere; included before the first target.
#
# ISOHEAD_FUZZ  libfuzzer: with clang; afl: with afl-clang-fast; empty: no fuzzers.
set(ISOHEAD_FUZZ "" CACHE STRING "Build the fuzzers, and nothing else: libfuzzer or afl")

if(ISOHEAD_FUZZ)
  set(sanitizers -fsanitize=address,undefined,float-cast-overflow -fno-sanitize-recover=all
      -fno-omit-frame-pointer)
  add_compile_options(${sanitizers} -g)
  add_link_options(${sanitizers})
  if(ISOHEAD_FUZZ STREQUAL "libfuzzer")
    add_compile_options(-fsanitize=fuzzer-no-link)
  elseif(NOT ISOHEAD_FUZZ STREQUAL "afl")
    message(FATAL_ERROR "ISOHEAD_FUZZ is '${ISOHEAD_FUZZ}', expected libfuzzer or afl")
  endif()
  # What C allows and we do not do: unsigned wrap-around, conversions that change a value. Only in our
  # own sources, cJSON thinks otherwise.
  target_compile_options(isohead_warnings INTERFACE
    -fsanitize=integer,implicit-conversion -fno-sanitize-recover=all)
endif()
