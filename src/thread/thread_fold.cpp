// Folds of a thread, which are taken out where no solution can be found.
#include <algorithm>
#include <limits>

#include "slender_sim/thread/thread_remesh.h"

namespace slender {

namespace {

/// A removal that may take out a fold: the edges j and j + 1 become one.
struct Removal
{
  enum class Kind
  {
    inner,
    oldest,
    newest
  } kind;
  int node;   ///< that is removed
  int joined() const { return kind == Kind::oldest ? 0 : kind == Kind::newest ? node - 2 : node - 1; }
};

/// 1 + cosine of the sharpest turn at the nodes first to last: 0 at a perfect fold.
double sharpestTurn(const ThreadState& state, int first, int last)
{
  double sharpest = 2.0;
  for (int i = std::max(first, 1); i <= std::min(last, state.nodes() - 2); ++i)
    sharpest = std::min(sharpest, 1.0 + state.edge(i - 1).normalized().dot(state.edge(i).normalized()));
  return sharpest;
}

bool isPossible(const ThreadState& state, const Removal& removal, int fold, const RemeshGuard* guard)
{
  constexpr double kLeast =
      0.1;   // of the shorter edge: two edges that cover each other do not become one of no length
  const int i = removal.node;
  if (removal.kind != Removal::Kind::inner)
    return state.nodes() > 2 && !state.ends[i > 0].held && !state.deposited[i];
  return i > 0 && i + 1 < state.nodes() && state.deposited[i] == state.deposited[fold] &&
         (state.x[i + 1] - state.x[i - 1]).norm() > kLeast * std::min(state.edge(i - 1).norm(), state.edge(i).norm()) &&
         mayRemove(state, i, guard);
}

/// Whether there is room for the joined edge and for what its neighbours have become.
bool hasRoomAfter(const ThreadState& before, const ThreadState& after, int joined, const RemeshGuard* guard)
{
  constexpr RemeshGuard::Room kRoom = {kFirmShare, kFirmShare};
  if (!guard)
    return true;
  for (int j = std::max(joined - 1, 0); j <= std::min(joined + 1, after.edges() - 1); ++j)
  {
    const int first = j <= joined ? j : j + 1, last = j < joined ? j : j + 1;
    if (!guard->hasRoom(before, {first, last, after.x[j], after.x[j + 1], after.radius(j)}, kRoom))
      return false;
  }
  return true;
}

/// Removes the node, or the end, with which the fold becomes blunt and no edge wide. Returns false if there is none.
bool removeAtFold(ThreadState& state, int fold, const RemeshGuard* guard)
{
  constexpr double kBlunt = 0.5;   // 1 + cosine
  const double turn = sharpestTurn(state, fold - 2, fold + 2);
  ThreadState best, after;
  double best_turn = 0.0, best_radius = std::numeric_limits<double>::infinity();
  const auto attempt = [&](const Removal& removal) {
    if (!isPossible(state, removal, fold, guard))
      return;
    after = state;
    if (removal.kind == Removal::Kind::inner)
      removeNode(after, removal.node);
    else
      removeEnd(after, removal.kind == Removal::Kind::newest);
    const int joined = removal.joined();
    spreadFluid(after, joined);
    double radius = 0.0;
    for (int j = std::max(joined - 1, 0); j <= std::min(joined + 1, after.edges() - 1); ++j)
      radius = std::max(radius, after.radius(j));
    const double own_turn = std::min(sharpestTurn(after, joined - 1, joined + 2), kBlunt);
    const bool better = own_turn > best_turn || (own_turn == best_turn && radius < best_radius);
    if (!better || !hasRoomAfter(state, after, joined, guard))
      return;
    best_turn = own_turn;
    best_radius = radius;
    std::swap(best, after);
  };
  for (const int i : {fold, fold + 1, fold - 1})
    attempt({Removal::Kind::inner, i});
  if (fold == 1)
    attempt({Removal::Kind::oldest, 0});
  if (fold + 2 == state.nodes())
    attempt({Removal::Kind::newest, fold + 1});
  if (best.x.empty() || (turn < kBlunt && best_turn <= turn))
    return false;
  std::swap(state, best);
  return true;
}

}   // namespace

bool mendFold(ThreadState& state, int fold, const RemeshGuard* guard)
{
  if (!state.deposited[fold] || (state.deposited[fold - 1] && state.deposited[fold + 1]))
  {
    if (removeAtFold(state, fold, guard))
      return true;
    if (state.deposited[fold] || !(state.deposited[fold - 1] || state.deposited[fold + 1]))
      return false;
  }
  const int other = !state.deposited[fold] ? fold : state.deposited[fold + 1] ? fold - 1 : fold + 1;
  if ((other == 0 && state.ends[0].held) || (other + 1 == state.nodes() && state.ends[1].held))
    return false;
  state.v[other] = state.v[other != fold ? fold : state.deposited[fold + 1] ? fold + 1 : fold - 1];
  state.deposited[other] = 1;
  return true;
}

}   // namespace slender
