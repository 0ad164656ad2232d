#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <deque>
#include <set>
#include <string>
#include <utility>

namespace slender {

/// Messages that wait for their transforms. Those of one source and frame keep their order; others may overtake them,
/// so that a frame that nobody knows holds back nothing else. `Message` has the members `source` and `frame`.
template <class Message>
class PendingMessages
{
public:
  /// `most` may wait in all, a quarter of them of one source and frame, `patience` [s] each, of wall time.
  PendingMessages(std::size_t most, double patience)
    : most_(most),
      patience_(std::chrono::microseconds(static_cast<std::int64_t>(1e6 * patience)))
  {
  }

  bool empty() const { return waiting_.empty(); }
  void clear() { waiting_.clear(); }

  /// Returns true if messages of the same source and frame wait.
  bool holds(const Message& message) const { return countLike(message) > 0; }

  /// False when too many wait.
  bool add(const Message& message)
  {
    if (waiting_.size() >= most_ || 4 * countLike(message) >= most_)
      return false;
    waiting_.push_back({message, std::chrono::steady_clock::now() + patience_});
    return true;
  }

  /// deliver(message, why) is false while the transform is not known; expired(message, why) takes those that have
  /// waited too long.
  template <class Deliver, class Expired>
  void process(const Deliver& deliver, const Expired& expired)
  {
    const auto now = std::chrono::steady_clock::now();
    std::set<std::pair<int, std::string>> blocked;   // an earlier message of these still waits
    for (std::size_t i = 0; i < waiting_.size();)
    {
      const Entry& entry = waiting_[i];
      std::string why;
      const std::pair key(entry.message.source, entry.message.frame);
      const bool done = !blocked.count(key) && deliver(entry.message, &why);
      if (!done && (blocked.count(key) || now < entry.deadline))
      {
        blocked.insert(key);
        ++i;
        continue;
      }
      if (!done)
        expired(entry.message, why);
      waiting_.erase(waiting_.begin() + static_cast<std::ptrdiff_t>(i));
    }
  }

  /// Calls change(message) for each waiting message. It may change its argument. If it returns false, the message is
  /// dropped.
  template <class Change>
  void change(const Change& change)
  {
    const auto lost = [&](Entry& entry) { return !change(entry.message); };
    waiting_.erase(std::remove_if(waiting_.begin(), waiting_.end(), lost), waiting_.end());
  }

private:
  struct Entry
  {
    Message message;
    std::chrono::steady_clock::time_point deadline;
  };

  std::size_t countLike(const Message& message) const
  {
    return static_cast<std::size_t>(std::count_if(waiting_.begin(), waiting_.end(), [&](const Entry& e) {
      return e.message.source == message.source && e.message.frame == message.frame;
    }));
  }

  std::size_t most_;
  std::chrono::steady_clock::duration patience_;
  std::deque<Entry> waiting_;
};

}   // namespace slender
