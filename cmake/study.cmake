# The study program: experiments behind the package's claims, without ROS.
file(GLOB STUDY_SOURCES CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/study/*/*.cpp)
# Scenes that studies run, and what they refer to, are built in: `study` finds them wherever it is installed, and they are those of the package.
foreach(path scenes/backflip.yaml scenes/chain.yaml scenes/cloth_on_branch.yaml scenes/hair.yaml scenes/helical_buckling.yaml scenes/knot_twist.yaml scenes/plectoneme.yaml scenes/tree.yaml
        meshes/bag.obj motion/backflip_keys.csv)
  set(package_file ${PROJECT_SOURCE_DIR}/config/${path})
  file(READ ${package_file} file_text)
  string(APPEND FILE_TEXTS "    {\"${path}\", R\"text(${file_text})text\"},\n")
  set_property(DIRECTORY ${PROJECT_SOURCE_DIR} APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${package_file})
endforeach()
configure_file(${CMAKE_CURRENT_LIST_DIR}/package_scenes.cpp.in ${PROJECT_BINARY_DIR}/package_scenes.cpp @ONLY)
# Object files, because a linker would leave out what only registers itself.
add_library(slender_sim_studies OBJECT ${STUDY_SOURCES} ${PROJECT_BINARY_DIR}/package_scenes.cpp)
target_include_directories(slender_sim_studies PUBLIC ${PROJECT_SOURCE_DIR}/include)
target_link_libraries(slender_sim_studies PUBLIC slender_sim PRIVATE fcl)   # a check that is independent of contact
slender_compile_together(slender_sim_studies
  <Eigen/Dense> <slender_sim/scene/reader.h> <slender_sim/scene/simulation.h> <slender_sim/study/study.h>)
# lean tells instructions apart by the lines that they come from; repeatability runs the scenes of the package. Their
# definitions differ from those of other studies, so they are compiled by themselves and without precompiled headers.
foreach(study lean repeatability)
  set_source_files_properties(${PROJECT_SOURCE_DIR}/src/study/performance/${study}.cpp PROPERTIES
    COMPILE_DEFINITIONS SLENDER_SOURCE_DIR="${PROJECT_SOURCE_DIR}" SKIP_PRECOMPILE_HEADERS ON)
endforeach()

# `study` is too common a name for a target in a shared catkin workspace.
set(TOOLS ${PROJECT_SOURCE_DIR}/src/tools)
add_executable(slender_sim_study_program ${TOOLS}/study.cpp ${TOOLS}/study_check.cpp ${TOOLS}/study_report.cpp ${TOOLS}/report_page.cpp ${TOOLS}/results_page.cpp
  ${TOOLS}/loaded_study.cpp)
# Reports name version and commit.
set(COMMIT_HEADER ${PROJECT_BINARY_DIR}/commit/commit.h)
add_custom_target(slender_sim_commit BYPRODUCTS ${COMMIT_HEADER}
  COMMAND ${CMAKE_COMMAND} -DSOURCE=${PROJECT_SOURCE_DIR} -DOUT=${COMMIT_HEADER} -P ${CMAKE_CURRENT_LIST_DIR}/commit.cmake)
add_dependencies(slender_sim_study_program slender_sim_commit)
target_include_directories(slender_sim_study_program PRIVATE ${PROJECT_BINARY_DIR}/commit)
set_property(SOURCE ${TOOLS}/study_report.cpp PROPERTY COMPILE_DEFINITIONS SLENDER_VERSION="${PROJECT_VERSION}")
set_target_properties(slender_sim_study_program PROPERTIES OUTPUT_NAME study)
target_link_libraries(slender_sim_study_program PRIVATE slender_sim_studies)
add_executable(slender_sim_sweep_program ${TOOLS}/sweep.cpp ${TOOLS}/sweep_runs.cpp ${TOOLS}/sweep_engines.cpp)
set_target_properties(slender_sim_sweep_program PROPERTIES OUTPUT_NAME sweep)
target_link_libraries(slender_sim_sweep_program PRIVATE slender_sim_studies)
install(TARGETS slender_sim_study_program slender_sim_sweep_program RUNTIME DESTINATION ${INSTALL_BIN})

if(BUILD_BENCHMARKS)
  find_package(benchmark REQUIRED)
  find_package(LAPACK REQUIRED)   # BLA_VENDOR picks one
  add_executable(banded_ldlt_benchmark ${PROJECT_SOURCE_DIR}/bench/banded_ldlt_benchmark.cpp)
  target_link_libraries(banded_ldlt_benchmark PRIVATE slender_sim benchmark::benchmark LAPACK::LAPACK)
  add_executable(contact_benchmark ${PROJECT_SOURCE_DIR}/bench/contact_benchmark.cpp)
  target_include_directories(contact_benchmark PRIVATE ${PROJECT_SOURCE_DIR}/src)
  target_link_libraries(contact_benchmark PRIVATE slender_sim benchmark::benchmark fcl)
  add_executable(cloth_collision_benchmark ${PROJECT_SOURCE_DIR}/bench/cloth_collision_benchmark.cpp)
  target_include_directories(cloth_collision_benchmark PRIVATE ${PROJECT_SOURCE_DIR} ${PROJECT_SOURCE_DIR}/src)
  target_link_libraries(cloth_collision_benchmark PRIVATE slender_sim benchmark::benchmark fcl)
endif()

if(BUILD_TESTING)
  find_package(GTest REQUIRED)
  file(GLOB STUDY_TESTS CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/test/study/*.cpp)
  add_executable(study_tests ${STUDY_TESTS})
  slender_compile_together(study_tests <gtest/gtest.h> <Eigen/Dense> <slender_sim/study/study.h>)
  target_include_directories(study_tests PRIVATE ${PROJECT_SOURCE_DIR} ${PROJECT_SOURCE_DIR}/src)
  target_compile_definitions(study_tests PRIVATE SLENDER_SWEEP="$<TARGET_FILE:slender_sim_sweep_program>" SLENDER_STUDY="$<TARGET_FILE:slender_sim_study_program>"
    SLENDER_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  target_link_libraries(study_tests PRIVATE slender_sim_studies GTest::gtest GTest::gtest_main)
  add_dependencies(study_tests slender_sim_sweep_program slender_sim_study_program)
  set_target_properties(study_tests PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/test_programs)
  slender_gtest(study_tests)
  # The quick form of every study, judged: one test each, study.NAME. Those that take more than ten seconds are slow.
  set(SLOW_STUDIES cloth_accuracy cloth_collision_safety coiling cost_model coupled_safety drape fabric_drape flag ibm_vs_hinge lean
    partitions rod_implicit_vs_explicit rod_stability stick_slip_strip stiffness_range thread_stability tracking_methods tracking_overhead)
  configure_file(${CMAKE_CURRENT_LIST_DIR}/study_tests.cmake.in ${PROJECT_BINARY_DIR}/study_tests.cmake.in @ONLY)
  file(GENERATE OUTPUT ${PROJECT_BINARY_DIR}/study_tests.cmake INPUT ${PROJECT_BINARY_DIR}/study_tests.cmake.in)
  set_property(DIRECTORY ${PROJECT_SOURCE_DIR} APPEND PROPERTY TEST_INCLUDE_FILES ${PROJECT_BINARY_DIR}/study_tests.cmake)
endif()
