# The study program: experiments behind the package's claims, without ROS.
file(GLOB STUDY_SOURCES CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/study/*.cpp)
# Scenes that studies run are built in: `study` finds them wherever it is installed, and they are those of the package.
foreach(scene chain hair knot_twist plectoneme tree)
  set(scene_file ${PROJECT_SOURCE_DIR}/config/scenes/${scene}.yaml)
  file(READ ${scene_file} scene_text)
  string(APPEND SCENE_TEXTS "    {\"${scene}\", R\"yaml(${scene_text})yaml\"},\n")
  set_property(DIRECTORY ${PROJECT_SOURCE_DIR} APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${scene_file})
endforeach()
configure_file(${CMAKE_CURRENT_LIST_DIR}/package_scenes.cpp.in ${PROJECT_BINARY_DIR}/package_scenes.cpp @ONLY)
add_library(slender_sim_studies STATIC ${STUDY_SOURCES} ${PROJECT_BINARY_DIR}/package_scenes.cpp)
target_include_directories(slender_sim_studies PUBLIC ${PROJECT_SOURCE_DIR}/include PRIVATE ${PROJECT_SOURCE_DIR})
target_link_libraries(slender_sim_studies PUBLIC slender_sim)

# `study` is too common a name for a target in a shared catkin workspace.
add_executable(slender_sim_study_program ${PROJECT_SOURCE_DIR}/src/tools/study.cpp)
set_target_properties(slender_sim_study_program PROPERTIES OUTPUT_NAME study)
target_link_libraries(slender_sim_study_program PRIVATE slender_sim_studies)
install(TARGETS slender_sim_study_program RUNTIME DESTINATION ${INSTALL_BIN})

if(BUILD_BENCHMARKS)
  find_package(benchmark REQUIRED)
  find_package(LAPACK REQUIRED)   # BLA_VENDOR picks one
  add_executable(banded_ldlt_benchmark ${PROJECT_SOURCE_DIR}/bench/banded_ldlt_benchmark.cpp)
  target_link_libraries(banded_ldlt_benchmark PRIVATE slender_sim benchmark::benchmark LAPACK::LAPACK)
  add_executable(contact_benchmark ${PROJECT_SOURCE_DIR}/bench/contact_benchmark.cpp)
  target_link_libraries(contact_benchmark PRIVATE slender_sim benchmark::benchmark fcl)
endif()

if(BUILD_TESTING)
  find_package(GTest REQUIRED)
  file(GLOB STUDY_TESTS CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/test/study/*.cpp)
  add_executable(study_tests ${STUDY_TESTS})
  target_link_libraries(study_tests PRIVATE slender_sim_studies GTest::gtest GTest::gtest_main)
  set_target_properties(study_tests PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/test_programs)
  add_test(NAME study COMMAND study_tests)
endif()
