if(WITH_ROS)
  include(cmake/nodes.cmake)
endif()
