# Tests without ROS; those with it are in nodes.cmake. scripts/test builds and runs them all.
# Each test case is a test of CTest: `ctest --test-dir build -j2 -R NAME` chooses some. Those with the label `slow` are left out
# by `scripts/test`, and run by `scripts/test --all`.
find_package(GTest REQUIRED)
foreach(kind unit analytic scenes)
  file(GLOB test_sources CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/test/${kind}/*.cpp)
  if(test_sources)
    add_executable(${kind}_tests ${test_sources})
    target_include_directories(${kind}_tests PRIVATE ${PROJECT_SOURCE_DIR})
    target_compile_definitions(${kind}_tests PRIVATE SLENDER_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
    target_link_libraries(${kind}_tests PRIVATE slender_sim GTest::gtest GTest::gtest_main)
    slender_compile_together(${kind}_tests
      <gtest/gtest.h> <Eigen/Dense> <slender_sim/scene/reader.h> <slender_sim/scene/simulation.h>)
    target_compile_options(${kind}_tests PRIVATE $<$<CONFIG:Release>:-Og>)   # tests spend their time in the library
    if(assimp_FOUND)
      target_compile_definitions(${kind}_tests PRIVATE SLENDER_WITH_ASSIMP)
    endif()
    # Not among the programs that rosrun offers.
    set_target_properties(${kind}_tests PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/test_programs)
    slender_gtest(${kind}_tests)
  endif()
endforeach()
if(TARGET scenes_tests)
  add_dependencies(scenes_tests slender_sim_simulate slender_sim_fair_mesh slender_sim_regions
    slender_sim_scene_reference)
  get_target_property(simulate_definitions slender_sim_simulate COMPILE_DEFINITIONS)
  set(has_bag 0)
  if("SLENDER_WITH_BAG" IN_LIST simulate_definitions)
    set(has_bag 1)
  endif()
  target_compile_definitions(scenes_tests PRIVATE SLENDER_HAS_BAG=${has_bag}
    SLENDER_SIMULATE="$<TARGET_FILE:slender_sim_simulate>" SLENDER_FAIR_MESH="$<TARGET_FILE:slender_sim_fair_mesh>"
    SLENDER_REGIONS="$<TARGET_FILE:slender_sim_regions>"
    SLENDER_SCENE_REFERENCE="$<TARGET_FILE:slender_sim_scene_reference>")
endif()
foreach(program study_tests node_unit_tests)
  if(TARGET ${program})
    set_target_properties(${program} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/test_programs)
  endif()
endforeach()

# README, docs/ and the change log: their form, and that what they name is there.
add_test(NAME documents COMMAND ${PROJECT_SOURCE_DIR}/test/docs/check_documents.py --self-test)
