#pragma once

#include <algorithm>
#include <deque>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include <ros/time.h>

#include "slender_sim/node/sim_clock.h"

namespace slender {

/// What becomes of a message, by its stamp.
enum class Arrival
{
  now,           ///< it counts
  kept,          ///< it is of the present, at which the paused simulation has not arrived; it counts when that goes on
  stale,         ///< older than ~guide_timeout
  from_future,   ///< more than ~guide_ahead ahead
};

/// Keeps messages that arrive while the simulation is paused and the time of others goes on. Their stamps run away from
/// the simulated time, so that they can be followed only when the simulation goes on, which is then at their present.
/// Of each source it keeps the messages of the last `timeout` seconds, and the last one however old it is. `Message`
/// has a member `stamp`; stamp zero means now.
template <class Message>
class PausedMessages
{
public:
  /// `timeout`: ~guide_timeout, `ahead`: ~guide_ahead [s]. The clock outlives this object.
  PausedMessages(const SimClock& clock, double timeout, double ahead) : clock_(clock), timeout_(timeout), ahead_(ahead)
  {
  }

  /// `present` returns the time of others while the simulation stands still, and the clock's stamp while it runs.
  void onPresent(std::function<ros::Time()> present) { present_ = std::move(present); }

  /// Decides by the message's stamp, and completes stamp zero. A message that is kept is copied.
  Arrival arrive(int source, Message& message)
  {
    const double now = clock_.seconds(), present = present_ ? std::max(now, clock_.secondsAt(present_())) : now;
    const bool stands = present > now + kRounding;
    if (message.stamp.isZero() && !stands)
      message.stamp = clock_.stamp();
    if (message.stamp.isZero())
    {
      auto& last = without_stamp_[source];
      last.clear();
      last.push_back(message);
      return Arrival::kept;
    }
    const double time = clock_.secondsAt(message.stamp);
    if (time > present + ahead_)
      return Arrival::from_future;
    if (time <= now + ahead_)
      return now - time > timeout_ ? Arrival::stale : Arrival::now;
    std::deque<Message>& kept = with_stamp_[source];
    kept.push_back(message);
    while (kept.size() > 1 &&
           (kept.size() > kMostKept || clock_.secondsAt(kept.front().stamp) < std::min(present, time) - timeout_))
      kept.pop_front();
    return Arrival::kept;
  }

  /// Hands out what counts from now on, in the order of the stamps: with `all` everything, because the simulation goes
  /// on at the present; else what has no stamp, because it takes a few steps.
  std::vector<std::pair<int, Message>> release(bool all)
  {
    std::vector<std::pair<int, Message>> out;
    const auto move = [&out](std::map<int, std::deque<Message>>& from) {
      for (auto& [source, messages] : from)
        for (Message& message : messages)
          out.emplace_back(source, std::move(message));
      from.clear();
    };
    if (all)
      move(with_stamp_);
    std::stable_sort(out.begin(), out.end(),
                     [](const auto& a, const auto& b) { return a.second.stamp < b.second.stamp; });
    const std::size_t stamped = out.size();
    move(without_stamp_);
    for (std::size_t k = stamped; k < out.size(); ++k)
      out[k].second.stamp = clock_.stamp();
    return out;
  }

  /// Takes over what another object keeps. change(source, message) may change both; messages for which it returns
  /// false are dropped.
  template <class Change>
  void takeOver(PausedMessages& before, const Change& change)
  {
    const auto move = [&change](std::map<int, std::deque<Message>>& from, std::map<int, std::deque<Message>>& to) {
      for (auto& [source, messages] : from)
        for (Message& message : messages)
        {
          int now = source;
          if (change(now, message))
            to[now].push_back(std::move(message));
        }
    };
    move(before.with_stamp_, with_stamp_);
    move(before.without_stamp_, without_stamp_);
  }

  void clear()
  {
    with_stamp_.clear();
    without_stamp_.clear();
  }

private:
  static constexpr double kRounding = 1e-6;        // [s] stamps are whole nanoseconds
  static constexpr std::size_t kMostKept = 1000;   // of a source

  const SimClock& clock_;
  double timeout_, ahead_;
  std::function<ros::Time()> present_;
  std::map<int, std::deque<Message>> with_stamp_, without_stamp_;   // by source
};

}   // namespace slender
