#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <string>

namespace slender {

/// Why an incoming message (or an entry of one) was dropped.
enum class Drop
{
  not_finite,       ///< NaN or infinite numbers
  bad_quaternion,   ///< length off 1 by more than 1 %
  wrong_length,     ///< arrays that do not fit the scene or each other
  unknown_name,     ///< a body that nothing follows
  bad_frame,        ///< no frame_id
  no_transform,     ///< tf2 did not know the transform at the message's stamp in time
  out_of_order,     ///< not later than the last one
  stale,            ///< older than ~guide_timeout
  from_future,      ///< more than ~guide_ahead ahead: another clock
  out_of_range,     ///< a number that cannot be (a negative flow, a belt at 1e9 m/s)
  queue_full,       ///< too many messages wait for transforms
};
constexpr int kDropReasons = 11;

const char* toString(Drop reason);

/// Counts all messages, and dropped messages by reason. Warns at most once a second about each reason.
class DropCounter
{
public:
  /// Notes that a paused node keeps a message. The log says so once, and again only after deliveredKept().
  void keep(const std::string& what);
  void deliveredKept() { told_of_kept_ = false; }

  /// Counts a message. Call it for each message that arrives, also if it is dropped later.
  void receive() { ++received_; }
  std::uint64_t received() const { return received_; }

  /// Counts a dropped message. `what` is for example the topic. `detail` ends the sentence of the warning, for example
  /// with the value.
  void drop(Drop reason, const std::string& what, const std::string& detail = "");

  /// Counts a message that is dropped because of its stamp. `ahead` is the stamp minus the simulated time [s].
  void dropByStamp(bool stale, const std::string& what, double ahead);

  std::uint64_t count(Drop reason) const { return reasons_[static_cast<int>(reason)].count; }
  std::uint64_t total() const;
  /// Returns the last message that was dropped for this reason, with its detail, or an empty text.
  const std::string& last(Drop reason) const { return reasons_[static_cast<int>(reason)].last; }

private:
  struct Reason
  {
    std::uint64_t count = 0, silent = 0;
    std::chrono::steady_clock::time_point warned{};   // wall time: simulated time may stand still
    std::string last;
  };
  std::array<Reason, kDropReasons> reasons_;
  std::uint64_t received_ = 0;
  bool told_of_kept_ = false;
};

}   // namespace slender
