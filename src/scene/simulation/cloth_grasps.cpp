#include "cloth_grasps.h"

#include <algorithm>
#include <stdexcept>

#include "slender_sim/cloth/cloth_model.h"

namespace slender {

ClothGrasp clothGraspOf(const ClothState& cloth, std::vector<int> vertices)
{
  ClothGrasp grasp;
  const auto count = static_cast<Eigen::Index>(vertices.size());
  grasp.points_G.resize(3, count);
  for (Eigen::Index k = 0; k < count; ++k)
    grasp.points_G.col(k) = cloth.x.col(vertices[k]);
  grasp.X_WG.position = grasp.points_G.rowwise().mean();
  grasp.points_G.colwise() -= grasp.X_WG.position;
  grasp.vertices = std::move(vertices);
  return grasp;
}

void checkVertices(const std::vector<int>& vertices, const ClothConfig& config, const ClothState& cloth,
                   const std::vector<ClothGrasp>& grasps, std::size_t index)
{
  const std::string name = "grasp " + config.grasps[index].name;
  const auto count = cloth.x.cols();
  if (vertices.empty())
    throw std::invalid_argument(name + " holds no vertex; give it at least one");
  if (vertices.front() < 0 || vertices.back() >= count)
  {
    throw std::invalid_argument(name + " holds vertex " +
                                std::to_string(vertices.front() < 0 ? vertices.front() : vertices.back()) +
                                "; must be in [0, " + std::to_string(count - 1) + "]");
  }
  for (std::size_t other = 0; other < grasps.size(); ++other)
  {
    const ClothGrasp& grasp = grasps[other];
    for (const int vertex : grasp.vertices)
    {
      if (other != index && grasp.active && std::binary_search(vertices.begin(), vertices.end(), vertex))
      {
        throw std::invalid_argument(name + " holds vertex " + std::to_string(vertex) + ", which grasp " +
                                    config.grasps[other].name + " holds already");
      }
    }
  }
}

void gatherPins(const std::vector<ClothGrasp>& grasps, ClothState& cloth)
{
  cloth.pins.clear();
  for (const ClothGrasp& grasp : grasps)
    if (grasp.active)
      pinVertices(cloth, grasp.vertices);
}

}   // namespace slender
