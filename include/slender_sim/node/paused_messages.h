#pragma once

#include <algorithm>
#include <deque>
#include <functional>
#include <iterator>
#include <map>
#include <utility>
#include <vector>

#include <ros/time.h>

#include "slender_sim/node/sim_clock.h"

namespace slender {

/// How a message is treated because of its stamp.
enum class Arrival
{
  now,           ///< used now
  kept,          ///< ahead of the paused simulation; kept until the simulation goes on
  stale,         ///< dropped: older than ~guide_timeout
  from_future,   ///< dropped: more than ~guide_ahead in the future
};

/// Keeps messages that arrive while the simulation is paused and the time of other nodes goes on. The stamps of these
/// messages are ahead of the simulated time. The simulation uses them when it continues at the present time of the
/// other nodes. For each source the class keeps the messages of the last `timeout` seconds, and always the last
/// message. `Message` has the members `source` and `stamp`; stamp zero means now.
template <class Message>
class PausedMessages
{
public:
  /// `timeout` is ~guide_timeout [s], `ahead` is ~guide_ahead [s]. The clock must outlive this object.
  PausedMessages(const SimClock& clock, double timeout, double ahead) : clock_(clock), timeout_(timeout), ahead_(ahead)
  {
  }

  /// `present` returns the clock's stamp while the simulation runs, and the time of other nodes while it stands still.
  void onPresent(std::function<ros::Time()> present) { present_ = std::move(present); }

  /// Decides by its stamp how a message is treated. If the simulation runs, stamp zero is replaced by the present
  /// stamp. A message that is kept is copied.
  Arrival arrive(Message& message)
  {
    const double now = clock_.seconds(), present = present_ ? std::max(now, clock_.secondsAt(present_())) : now;
    const bool stands = present > now + kRounding;
    if (message.stamp.isZero() && !stands)
      message.stamp = clock_.stamp();
    if (message.stamp.isZero())
    {
      auto& last = without_stamp_[message.source];
      last.clear();
      last.push_back(message);
      return Arrival::kept;
    }
    const double time = clock_.secondsAt(message.stamp);
    if (time > present + ahead_)
      return Arrival::from_future;
    if (time <= now + ahead_)
      return now - time > timeout_ ? Arrival::stale : Arrival::now;
    std::deque<Message>& kept = with_stamp_[message.source];
    kept.push_back(message);
    while (kept.size() > 1 &&
           (kept.size() > kMostKept || clock_.secondsAt(kept.front().stamp) < std::min(present, time) - timeout_))
      kept.pop_front();
    return Arrival::kept;
  }

  /// Returns and forgets kept messages, in the order of their stamps. With `all` the simulation continues at the
  /// present time, and all messages are returned. Otherwise it takes only a few steps, and messages without a stamp are
  /// returned.
  std::vector<Message> release(bool all)
  {
    std::vector<Message> out;
    const auto move = [&out](std::map<int, std::deque<Message>>& from) {
      for (auto& [source, messages] : from)
        std::move(messages.begin(), messages.end(), std::back_inserter(out));
      from.clear();
    };
    if (all)
      move(with_stamp_);
    std::stable_sort(out.begin(), out.end(), [](const Message& a, const Message& b) { return a.stamp < b.stamp; });
    const std::size_t stamped = out.size();
    move(without_stamp_);
    for (std::size_t k = stamped; k < out.size(); ++k)
      out[k].stamp = clock_.stamp();
    return out;
  }

  /// Takes over the messages of another object. change(message) may change its argument. If it returns false, the
  /// message is dropped.
  template <class Change>
  void takeOver(PausedMessages& before, const Change& change)
  {
    const auto move = [&change](std::map<int, std::deque<Message>>& from, std::map<int, std::deque<Message>>& to) {
      for (auto& [source, messages] : from)
        for (Message& message : messages)
          if (change(message))
            to[message.source].push_back(std::move(message));
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
  static constexpr std::size_t kMostKept = 1000;   // messages per source

  const SimClock& clock_;
  double timeout_, ahead_;
  std::function<ros::Time()> present_;
  std::map<int, std::deque<Message>> with_stamp_, without_stamp_;   // by source
};

}   // namespace slender
