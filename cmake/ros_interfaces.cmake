# Messages and services, and what dependent packages get.
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME messages)   # see packages.cmake
file(GLOB MESSAGES RELATIVE ${PROJECT_SOURCE_DIR}/msg CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/msg/*.msg)
file(GLOB SERVICES RELATIVE ${PROJECT_SOURCE_DIR}/srv CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/srv/*.srv)
if(MESSAGES)
  add_message_files(FILES ${MESSAGES})
endif()
if(SERVICES)
  add_service_files(FILES ${SERVICES})
endif()
generate_messages(DEPENDENCIES std_msgs geometry_msgs LANGS gencpp genpy)
# Whether there are libraries decides slender_sim-library.cmake when a dependent package is configured.
catkin_package(
  INCLUDE_DIRS include
  CATKIN_DEPENDS geometry_msgs message_runtime std_msgs
  CFG_EXTRAS slender_sim-library.cmake)
# Here, because pluginlib complains about packages whose list of nodelets is missing.
install(FILES nodelets.xml DESTINATION ${CATKIN_PACKAGE_SHARE_DESTINATION})
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME programs)

# rosrun passes over folders named build in a package; here it finds the programs of one (if the source folder can be written).
if(CATKIN_DEVEL_PREFIX STREQUAL "${PROJECT_SOURCE_DIR}/build/devel")
  file(CREATE_LINK build/devel/${CATKIN_PACKAGE_BIN_DESTINATION} ${PROJECT_SOURCE_DIR}/.rosrun RESULT unwritable SYMBOLIC)
endif()
