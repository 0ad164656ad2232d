#pragma once

#include <ros/node_handle.h>

#include "slender_sim/FairMesh.h"

namespace slender {

/// Offers the service `~fair_mesh` (srv/FairMesh.srv). It has no state: each call stands for itself.
class FairingNode
{
public:
  /// Throws OptionError: it has no parameters.
  explicit FairingNode(ros::NodeHandle nh_priv);

  /// Answers a request; a mesh or options that cannot be used are refused with the reason in the answer.
  static bool fair(slender_sim::FairMesh::Request& request, slender_sim::FairMesh::Response& response);

private:
  ros::ServiceServer server_;
};

}   // namespace slender
