# Messages and services, and what dependent packages get.
file(GLOB MESSAGES RELATIVE ${PROJECT_SOURCE_DIR}/msg CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/msg/*.msg)
file(GLOB SERVICES RELATIVE ${PROJECT_SOURCE_DIR}/srv CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/srv/*.srv)
if(MESSAGES)
  add_message_files(FILES ${MESSAGES})
endif()
if(SERVICES)
  add_service_files(FILES ${SERVICES})
endif()
generate_messages(DEPENDENCIES std_msgs geometry_msgs LANGS gencpp genpy)
catkin_package(
  INCLUDE_DIRS include
  LIBRARIES slender_sim slender_sim_node
  CATKIN_DEPENDS diagnostic_msgs geometry_msgs message_runtime roscpp sensor_msgs std_msgs std_srvs tf2_ros visualization_msgs
  DEPENDS EIGEN3)

# rosrun passes over folders named build in a package; here it finds the programs of one (if the source folder can be written).
if(CATKIN_DEVEL_PREFIX STREQUAL "${PROJECT_SOURCE_DIR}/build/devel")
  file(CREATE_LINK build/devel/${CATKIN_PACKAGE_BIN_DESTINATION} ${PROJECT_SOURCE_DIR}/.rosrun RESULT unwritable SYMBOLIC)
endif()
