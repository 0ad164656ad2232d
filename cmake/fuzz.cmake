# Fuzzing programs by libFuzzer, and what they start from: a folder of small files for each.
file(GLOB fuzzers CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/test/fuzz/*.cpp)
foreach(source ${fuzzers})
  get_filename_component(name ${source} NAME_WE)
  add_executable(${name} ${source})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE slender_sim)
  target_link_options(${name} PRIVATE -fsanitize=fuzzer)
endforeach()
