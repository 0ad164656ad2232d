# Everything that needs ROS: the node library, the nodes, their tests.
file(GLOB NODE_SOURCES CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/src/node/*.cpp)
add_library(slender_sim_node SHARED ${NODE_SOURCES})
slender_compile_together(slender_sim_node <ros/ros.h> <Eigen/Dense>)
add_dependencies(slender_sim_node ${PROJECT_NAME}_generate_messages_cpp)
target_compile_options(slender_sim_node PRIVATE -O1)
target_include_directories(slender_sim_node PUBLIC
  $<BUILD_INTERFACE:${CATKIN_DEVEL_PREFIX}/include> ${catkin_INCLUDE_DIRS}
  PRIVATE ${PROJECT_SOURCE_DIR}/src)
target_link_libraries(slender_sim_node PUBLIC slender_sim ${catkin_LIBRARIES} PRIVATE yaml-cpp)

foreach(node scene_node rod_node thread_node cloth_node tracking_node fairing_node motion_player rviz_on_scene)
  add_executable(${node} ${PROJECT_SOURCE_DIR}/src/nodes/${node}.cpp)
  target_include_directories(${node} PRIVATE ${PROJECT_SOURCE_DIR}/src ${PROJECT_SOURCE_DIR}/src/node)
  target_link_libraries(${node} PRIVATE slender_sim_node)
endforeach()

# The same as nodelets. The library is loaded by name (nodelets.xml).
add_library(slender_sim_nodelets MODULE ${PROJECT_SOURCE_DIR}/src/nodes/nodelets.cpp)
target_link_libraries(slender_sim_nodelets PRIVATE slender_sim_node ${nodelet_LIBRARIES})
target_include_directories(slender_sim_nodelets PRIVATE ${nodelet_INCLUDE_DIRS})

if(BUILD_TESTING)
  find_package(rostest REQUIRED)
  # Pure functions and buffers: no master needed.
  add_executable(node_unit_tests
    ${PROJECT_SOURCE_DIR}/test/nodes/guide_buffer_test.cpp ${PROJECT_SOURCE_DIR}/test/nodes/converters_test.cpp
    ${PROJECT_SOURCE_DIR}/test/nodes/bag_recorder_test.cpp ${PROJECT_SOURCE_DIR}/test/nodes/markers_test.cpp
    ${PROJECT_SOURCE_DIR}/test/nodes/point_guide_buffer_test.cpp ${PROJECT_SOURCE_DIR}/test/nodes/late_guides_test.cpp
    ${PROJECT_SOURCE_DIR}/test/nodes/paused_messages_test.cpp ${PROJECT_SOURCE_DIR}/test/nodes/camera_fit_test.cpp
    ${PROJECT_SOURCE_DIR}/test/nodes/step_gaps_test.cpp ${PROJECT_SOURCE_DIR}/test/nodes/guide_gaps_test.cpp)
  slender_compile_together(node_unit_tests <gtest/gtest.h> <ros/ros.h> <Eigen/Dense>)
  target_compile_definitions(node_unit_tests PRIVATE SLENDER_SOURCE_DIR="${PROJECT_SOURCE_DIR}")
  find_package(GTest REQUIRED)
  target_link_libraries(node_unit_tests PRIVATE slender_sim_node yaml-cpp GTest::gtest GTest::gtest_main)
  slender_gtest(node_unit_tests)

  # Loads the nodelets into itself: what is copied between them can be counted.
  add_executable(nodelet_tests ${PROJECT_SOURCE_DIR}/test/nodes/nodelet_test.cpp)
  target_link_libraries(nodelet_tests PRIVATE slender_sim_node ${nodelet_LIBRARIES} GTest::gtest)

  file(GLOB ROSTESTS CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/test/nodes/*.test)
  foreach(test ${ROSTESTS})
    add_rostest(${test} DEPENDENCIES scene_node rod_node thread_node cloth_node tracking_node fairing_node motion_player slender_sim_nodelets nodelet_tests slender_sim_simulate ${PROJECT_NAME}_generate_messages_py)
  endforeach()
  # Rostests have the label rostest: they wait more than they compute. Those that judge times run alone.
  get_property(tests DIRECTORY ${PROJECT_SOURCE_DIR} PROPERTY TESTS)
  foreach(test ${tests})
    if(test MATCHES "_rostest_")
      set_tests_properties(${test} PROPERTIES LABELS rostest)
    endif()
    if(test MATCHES "_rostest_.*(timing|demo|follow)\\.test")
      set_tests_properties(${test} PROPERTIES RUN_SERIAL ON)
    endif()
  endforeach()
endif()
