# Two Debian packages of this one catkin package, which scripts/package builds:
#   slender-sim-msgs   what catkin and rospack need to find the package, and its messages and services
#   slender-sim        libraries, headers, nodes, programs, configuration and launch files
# CMAKE_INSTALL_DEFAULT_COMPONENT_NAME decides where a file goes: `messages` in ros_interfaces.cmake, afterwards `programs`.
set(DEBIAN_FILES ${PROJECT_SOURCE_DIR}/cmake/debian)
foreach(package slender-sim-msgs:messages slender-sim:programs)
  string(REPLACE ":" ";" package ${package})
  list(GET package 0 name)
  list(GET package 1 component)
  install(FILES LICENSE DESTINATION share/doc/${name} RENAME copyright COMPONENT ${component})
endforeach()
# genpy installs byte code that names the build folder; postinst makes it anew.
install(CODE "file(GLOB_RECURSE cached \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CATKIN_PACKAGE_PYTHON_DESTINATION}/*.pyc\")
  foreach(file IN LISTS cached)
    get_filename_component(folder \"\${file}\" DIRECTORY)
    file(REMOVE_RECURSE \"\${folder}\")
  endforeach()" COMPONENT messages)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME slender-sim)
set(CPACK_PACKAGE_VENDOR slender_sim)
set(CPACK_PACKAGE_CONTACT "slender_sim maintainers <maintainers@slender-sim.org>")   # as in package.xml
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)   # line tables are for profilers, which need the sources beside them
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL messages library programs)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)

# std_msgs and geometry_msgs: the messages that ours refer to, for rosmsg, Python and C++. The -dev packages bring Boost's 15,000 headers,
# which take a minute to unpack, so that a robot may do without them (--no-install-recommends).
set(CPACK_DEBIAN_MESSAGES_PACKAGE_NAME slender-sim-msgs)
set(CPACK_DEBIAN_MESSAGES_DESCRIPTION "Messages and services of slender_sim
States of elastic rods, viscous threads, cloth and rigid bodies, for C++ and
Python. This is all that a program needs that listens to a simulation.")
set(CPACK_DEBIAN_MESSAGES_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_MESSAGES_PACKAGE_DEPENDS
  "python3, python3-genpy, python3-std-msgs, python3-geometry-msgs, ros-std-msgs, ros-geometry-msgs")
set(CPACK_DEBIAN_MESSAGES_PACKAGE_RECOMMENDS "libstd-msgs-dev, libgeometry-msgs-dev, ros-message-runtime, python3-rosmsg, python3-rospy")
set(CPACK_DEBIAN_MESSAGES_PACKAGE_CONTROL_EXTRA "${DEBIAN_FILES}/postinst;${DEBIAN_FILES}/prerm")

# Libraries come from dpkg-shlibdeps. The rest is what launch files start, and what programs call.
set(CPACK_DEBIAN_SIMULATION_PACKAGE_NAME slender-sim)
set(CPACK_DEBIAN_SIMULATION_DESCRIPTION "Simulation of slender deformable objects
ROS nodes, programs and a C++ library that simulate elastic rods, viscous
threads, cloth and thin shells, and shells that track a guide.")
set(CPACK_DEBIAN_SIMULATION_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR} ${CATKIN_DEVEL_PREFIX}/lib)
set(CPACK_DEBIAN_SIMULATION_PACKAGE_DEPENDS
  "slender-sim-msgs (= ${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}), rosbash, python3-roslaunch, python3-rosbag, python3-rosmsg, python3-rospy, python3-rosservice, python3-rostopic, libnodeletlib-tools")
set(CPACK_DEBIAN_SIMULATION_PACKAGE_RECOMMENDS "rviz, ffmpeg")
set(CPACK_DEBIAN_SIMULATION_PACKAGE_SUGGESTS
  "libdiagnostic-aggregator-tools, libdiagnostic-aggregator-dev, libeigen3-dev, libdiagnostic-msgs-dev, libdiagnostic-updater-dev, libinteractive-markers-dev, librosbag-dev, libroscpp-dev, libsensor-msgs-dev, libstd-srvs-dev, libtf2-ros-dev, libvisualization-msgs-dev, gnuplot-nox, parallel")

include(CPack)
cpack_add_component_group(simulation)
cpack_add_component(library GROUP simulation)
cpack_add_component(programs GROUP simulation)
