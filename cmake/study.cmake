# The study program: experiments behind the package's claims, without ROS.
file(GLOB STUDY_SOURCES CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/study/*.cpp)
add_library(slender_sim_studies STATIC ${STUDY_SOURCES})
target_include_directories(slender_sim_studies PUBLIC ${PROJECT_SOURCE_DIR}/include)
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
