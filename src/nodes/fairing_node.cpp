#include <stdexcept>

#include <ros/ros.h>

#include "param_reader.h"
#include "slender_sim/FairMesh.h"
#include "slender_sim/fairing/fair_mesh.h"
#include "slender_sim/node/converters.h"
#include "slender_sim/node/node_main.h"

/// fairing_node offers the service `~fair_mesh` (srv/FairMesh.srv). It has no state: each call stands for itself.
namespace slender {
namespace {

TriangleMesh meshOf(const slender_sim::FairMesh::Request& request)
{
  if (request.triangles.size() % 3 != 0)
    throw std::invalid_argument("triangles: " + std::to_string(request.triangles.size()) +
                                " numbers; must be three per triangle");
  TriangleMesh mesh;
  mesh.vertices = columnsOf(request.vertices);
  mesh.triangles.resize(3, static_cast<Eigen::Index>(request.triangles.size() / 3));
  for (std::size_t k = 0; k < request.triangles.size(); ++k)
  {
    if (request.triangles[k] >= request.vertices.size())
      throw std::invalid_argument("triangle " + std::to_string(k / 3) + " has vertex " +
                                  std::to_string(request.triangles[k]) + "; there are " +
                                  std::to_string(request.vertices.size()) + ", counted from 0");
    mesh.triangles.data()[k] = static_cast<int>(request.triangles[k]);
  }
  return mesh;
}

FairingOptions optionsOf(const slender_sim::FairMesh::Request& request)
{
  FairingOptions options;
  options.fill_holes = request.fill_holes;
  if (request.largest_hole > 0)
    options.largest_hole = request.largest_hole;
  options.edge_length = request.edge_length;
  options.steps = request.steps;
  options.smoothing = request.smoothing;
  if (!options.fill_holes && options.steps == 0)
    throw std::invalid_argument("nothing to do: set steps, fill_holes or both");
  if (request.region_centers.size() != request.region_radii.size())
    throw std::invalid_argument("region: " + std::to_string(request.region_centers.size()) + " centers and " +
                                std::to_string(request.region_radii.size()) + " radii; must be as many");
  for (std::size_t k = 0; k < request.region_centers.size(); ++k)
    options.region.push_back({fromMessage(request.region_centers[k]), request.region_radii[k]});
  return options;
}

/// Answers a request. A mesh or options that cannot be used are refused with the reason in the answer.
bool fair(slender_sim::FairMesh::Request& request, slender_sim::FairMesh::Response& response)
try
{
  TriangleMesh mesh = meshOf(request);
  const FairingSummary summary = fairMesh(mesh, "mesh", optionsOf(request));
  response.success = summary.ok;
  response.message = summary.message;
  if (!summary.ok)
    return true;
  for (Eigen::Index v = 0; v < mesh.vertices.cols(); ++v)
    response.vertices.push_back(toPoint(mesh.vertices.col(v)));
  response.triangles.assign(mesh.triangles.data(), mesh.triangles.data() + mesh.triangles.size());
  response.holes_closed = static_cast<std::uint32_t>(summary.holes);
  response.holes_open = static_cast<std::uint32_t>(summary.open_holes);
  response.steps = static_cast<std::uint32_t>(summary.steps);
  response.energy_before = summary.energy_before;
  response.energy = summary.energy;
  return true;
}
catch (const std::exception& error)   // a bad mesh or option; out of memory
{
  response = slender_sim::FairMesh::Response();
  response.message = error.what();
  return true;
}

}   // namespace
}   // namespace slender

int main(int argc, char** argv)
{
  return slender::nodeMain(argc, argv, "fairing_node", [] {
    ros::NodeHandle nh_priv("~");
    slender::ParamReader(nh_priv).refuseUnknown();   // The node has no parameters.
    const ros::ServiceServer server = nh_priv.advertiseService("fair_mesh", &slender::fair);
    ros::spin();
    return 0;
  });
}
