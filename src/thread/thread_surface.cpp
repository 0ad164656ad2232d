#include "slender_sim/thread/thread_surface.h"

#include "slender_sim/energy/end_cap.h"

namespace slender {

double surfaceArea(const ThreadState& state, SurfaceShape shape)
{
  const auto length = [&](int j) { return state.edge(j).norm(); };
  const auto lies = [&](int j) { return state.deposited[j] && state.deposited[j + 1]; };
  const auto half = [&](int j) { return endArea(length(j), state.volume[j]).value; };
  const auto end = [&](bool held, int j) {
    return held ? half(j) : freeEndArea(shape, length(j), state.volume[j]).value;
  };
  const int last = state.edges() - 1;
  double area = end(state.ends[0].held, 0) + end(state.ends[1].held, last);
  for (int j = 0; j < last; ++j)
    area += lies(j) == lies(j + 1)
                ? surfaceArea(shape, length(j), state.volume[j], length(j + 1), state.volume[j + 1]).value
                : half(j) + half(j + 1);
  return area;
}

}   // namespace slender
