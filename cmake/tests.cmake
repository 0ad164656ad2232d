# Tests without ROS; those with it are in nodes.cmake. scripts/test builds and runs them all.
find_package(GTest REQUIRED)
foreach(kind unit analytic scenes)
  file(GLOB test_sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/test/${kind}/*.cpp)
  if(test_sources)
    add_executable(${kind}_tests ${test_sources})
    target_include_directories(${kind}_tests PRIVATE ${PROJECT_SOURCE_DIR})
    target_compile_definitions(${kind}_tests PRIVATE SLENDER_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
    target_link_libraries(${kind}_tests PRIVATE slender_sim GTest::gtest GTest::gtest_main)
    # Not among the programs that rosrun offers.
    set_target_properties(${kind}_tests PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/test_programs)
    add_test(NAME ${kind} COMMAND ${kind}_tests)
  endif()
endforeach()
if(TARGET scenes_tests)
  add_dependencies(scenes_tests slender_sim_simulate)
  target_compile_definitions(scenes_tests PRIVATE SLENDER_SIMULATE="$<TARGET_FILE:slender_sim_simulate>"
    SLENDER_HAS_BAG=$<IN_LIST:SLENDER_WITH_BAG,$<TARGET_PROPERTY:slender_sim_simulate,COMPILE_DEFINITIONS>>)
endif()
