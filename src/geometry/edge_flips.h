#pragma once

#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include <Eigen/Core>

namespace slender {

/// Replaces edges between two faces by the other diagonal of these faces [Lawson's flips]. The edge a-b has the face of
/// c on its left and that of d on its right. It is replaced if wanted(a, b, c, d) is true and the edge c-d does not
/// exist yet. The function ends when no such edge is left, or after fifty turns per edge of the mesh, because flips of
/// curved meshes may run in circles. A Delaunay mesh takes a few turns per edge.
template <class Wanted>
void flipEdges(std::vector<Eigen::Vector3i>& faces, const Wanted& wanted)
{
  constexpr std::size_t kTurns = 50;
  std::map<std::pair<int, int>, int> face_of;   // directed edge
  const auto enter = [&](int f) {
    for (int k = 0; k < 3; ++k)
      face_of[{faces[f][k], faces[f][(k + 1) % 3]}] = f;
  };
  for (int f = 0; f < static_cast<int>(faces.size()); ++f)
    enter(f);
  std::vector<std::pair<int, int>> open;
  for (const auto& entry : face_of)
    if (entry.first.first < entry.first.second)
      open.push_back(entry.first);
  for (std::size_t left = kTurns * open.size(); left > 0 && !open.empty(); --left)
  {
    const auto [a, b] = open.back();
    open.pop_back();
    const auto over = face_of.find({a, b}), under = face_of.find({b, a});
    if (over == face_of.end() || under == face_of.end())
      continue;
    const int f = over->second, g = under->second, c = faces[f].sum() - a - b, d = faces[g].sum() - a - b;
    if (face_of.count({c, d}) || face_of.count({d, c}) || !wanted(a, b, c, d))
      continue;
    face_of.erase(over);
    face_of.erase({b, a});
    faces[f] = {c, a, d};
    faces[g] = {d, b, c};
    enter(f);
    enter(g);
    for (const auto& [s, t] : {std::pair{a, d}, std::pair{d, b}, std::pair{b, c}, std::pair{c, a}})
      open.emplace_back(s, t);
  }
}

}   // namespace slender
