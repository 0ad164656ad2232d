# Programs and installation. Nodes are in nodes.cmake, studies in study.cmake.
include(GNUInstallDirs)
if(WITH_ROS)
  set(INSTALL_LIB ${CATKIN_PACKAGE_LIB_DESTINATION})
  set(INSTALL_BIN ${CATKIN_PACKAGE_BIN_DESTINATION})
  set(INSTALL_SHARE ${CATKIN_PACKAGE_SHARE_DESTINATION})
  set(INSTALL_INCLUDE ${CATKIN_PACKAGE_INCLUDE_DESTINATION})
else()
  set(INSTALL_LIB ${CMAKE_INSTALL_LIBDIR})
  set(INSTALL_BIN ${CMAKE_INSTALL_BINDIR})
  set(INSTALL_SHARE ${CMAKE_INSTALL_DATADIR}/slender_sim)
  set(INSTALL_INCLUDE ${CMAKE_INSTALL_INCLUDEDIR}/slender_sim)
endif()
# Installed programs find the library beside them, sourced setup.bash or not.
set(CMAKE_INSTALL_RPATH "$ORIGIN;$ORIGIN/..;$ORIGIN/../${CMAKE_INSTALL_LIBDIR};$ORIGIN/../lib")
set_target_properties(slender_sim PROPERTIES INSTALL_RPATH "$ORIGIN")

# Rods of one scene are stepped in parallel where the compiler has OpenMP; results do not depend on it.
find_package(OpenMP QUIET COMPONENTS CXX)
if(OpenMP_CXX_FOUND)
  target_link_libraries(slender_sim PRIVATE OpenMP::OpenMP_CXX)
endif()

if(WITH_ROS)
  include(${PROJECT_SOURCE_DIR}/cmake/nodes.cmake OPTIONAL)
endif()
include(${PROJECT_SOURCE_DIR}/cmake/study.cmake OPTIONAL)

# The target's name is long because a catkin workspace shares names between packages.
add_executable(slender_sim_simulate src/tools/simulate.cpp src/tools/moduli.cpp src/tools/statics_report.cpp)
set_target_properties(slender_sim_simulate PROPERTIES OUTPUT_NAME simulate)
target_link_libraries(slender_sim_simulate PRIVATE slender_sim)
target_compile_options(slender_sim_simulate PRIVATE ${LINE_TABLES})
if(TARGET slender_sim_node AND EXISTS ${PROJECT_SOURCE_DIR}/include/slender_sim/node/bag_recorder.h)
  target_link_libraries(slender_sim_simulate PRIVATE slender_sim_node)
  target_compile_definitions(slender_sim_simulate PRIVATE SLENDER_WITH_BAG)
endif()

add_executable(slender_sim_fair_mesh src/tools/fair_mesh.cpp)
set_target_properties(slender_sim_fair_mesh PROPERTIES OUTPUT_NAME fair_mesh)
target_link_libraries(slender_sim_fair_mesh PRIVATE slender_sim)

add_executable(slender_sim_regions src/tools/regions.cpp)
set_target_properties(slender_sim_regions PROPERTIES OUTPUT_NAME regions)
target_link_libraries(slender_sim_regions PRIVATE slender_sim)

if(TARGET slender_sim_node)
  include(${PROJECT_SOURCE_DIR}/cmake/exports.cmake)
endif()
add_executable(slender_sim_scene_reference src/tools/scene_reference.cpp)
set_target_properties(slender_sim_scene_reference PROPERTIES OUTPUT_NAME scene_reference)
target_link_libraries(slender_sim_scene_reference PRIVATE slender_sim)

install(TARGETS slender_sim EXPORT slender_sim_targets
  ARCHIVE DESTINATION ${INSTALL_LIB} LIBRARY DESTINATION ${INSTALL_LIB} RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(TARGETS slender_sim_simulate slender_sim_fair_mesh slender_sim_regions slender_sim_scene_reference RUNTIME DESTINATION ${INSTALL_BIN})
if(TARGET slender_sim_node)
  set_target_properties(slender_sim_node slender_sim_nodelets PROPERTIES INSTALL_RPATH "$ORIGIN")
  install(FILES nodelets.xml DESTINATION ${INSTALL_SHARE})
  install(TARGETS slender_sim_node slender_sim_nodelets ARCHIVE DESTINATION ${INSTALL_LIB} LIBRARY DESTINATION ${INSTALL_LIB})
  foreach(node rod_node thread_node cloth_node tracking_node fairing_node motion_player)
    if(TARGET ${node})
      install(TARGETS ${node} RUNTIME DESTINATION ${INSTALL_BIN})
    endif()
  endforeach()
endif()
install(DIRECTORY include/slender_sim/ DESTINATION ${INSTALL_INCLUDE} FILES_MATCHING PATTERN "*.h")
foreach(folder config launch)
  if(IS_DIRECTORY ${PROJECT_SOURCE_DIR}/${folder})
    install(DIRECTORY ${folder} DESTINATION ${INSTALL_SHARE})
  endif()
endforeach()

if(NOT WITH_ROS)
  # find_package(slender_sim) without catkin (catkin writes its own configuration).
  install(EXPORT slender_sim_targets NAMESPACE slender_sim:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/slender_sim)
  file(WRITE ${PROJECT_BINARY_DIR}/slender_simConfig.cmake
    "include(CMakeFindDependencyMacro)\nfind_dependency(Eigen3 3.3)\nfind_dependency(Threads)\n"
    "include(\${CMAKE_CURRENT_LIST_DIR}/slender_sim_targets.cmake)\n")
  install(FILES ${PROJECT_BINARY_DIR}/slender_simConfig.cmake DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/slender_sim)
endif()
