#pragma once

#include <limits>
#include <optional>

namespace slender {

/// Decides which instant of a stream of stamped samples is shown at each simulated time.
///
/// Method. The instant is the simulated time minus a lag. A segment between two samples is final once the next sample
/// has arrived, because the slope at the segment's end depends on that sample. A stream therefore needs a lag of two
/// sample intervals plus the transport time. The lag that is needed is measured whenever a sample arrives.
///
/// While the needed lag is at most the given delay, the lag equals the delay exactly and does not depend on when
/// samples arrive. When samples come later, the lag grows to the needed value. It shrinks again some seconds after
/// samples come in time. The lag changes smoothly: the rate at which instants pass is 1 while the lag is constant, is
/// continuous, changes by at most 1 within 0.2 s, and exceeds 1 by at most 10 %. The motion then passes through the
/// same places a little slower or faster, without a jump of velocity. With the option `automatic` the lag is always the
/// needed one plus 10 % and 1 ms.
///
/// When a live stream runs dry, the rate falls to zero within 0.15 s, and the caller extrapolates meanwhile
/// (Instant::open). A stream ends when no sample has come for 0.4 s, or for 0.1 s while it has only two samples. A
/// sample begins a new stream when it comes after a pause of more than 0.25 s in which the last sample was reached.
class GuideTiming
{
public:
  struct Options
  {
    /// [s] >= 0, the lag while samples come in time. Two sample intervals plus the transport time are enough. With less
    /// the lag grows to what the samples need. With 0 there is never a lag, and late samples cause jumps of velocity.
    double delay = 0.05;
    bool automatic = false;   ///< the lag is the needed one; `delay` is used until the needed lag is known
    bool live = false;        ///< samples come in real time, so a missing sample may still come
    /// [s] >= 0. After the last sample the caller moves on for this time, and is then at rest. With 0 it holds the last
    /// sample. With more than 0 the rate does not fall when samples are missing.
    double coast = 0.0;
  };

  /// Throws std::invalid_argument when the delay or the coasting time is negative or not a number.
  explicit GuideTiming(const Options& options);

  /// A sample with this stamp [s] has arrived. Stamps must increase. Returns true when it begins a new stream.
  bool sample(double stamp);

  struct Instant
  {
    bool following = false;   ///< the stream has taken effect; the other members are valid only then
    bool began = false;       ///< the stream takes effect now
    /// The instant did not move on continuously. This happens when a stream ends after two samples: they are a step,
    /// not a motion, and the instant jumps to the last one.
    bool jumped = false;
    bool open = false;   ///< the stream goes on, so the motion after its last sample is unknown and not at rest
    double time = 0.0;   ///< [s] of the samples' stamps; never decreases within a stream
    double rate = 1.0;   ///< d(instant)/d(simulated time), >= 0
  };
  /// Moves on to simulated `time` [s], which does not decrease.
  Instant advance(double time);

  /// Returns the lag that this stream needs [s]. It is at least the delay.
  double wantedLag() const { return own(); }
  /// Sets a lower bound of the lag [s]. The bound has no effect if the delay is fixed at zero. Give all streams the
  /// largest wantedLag() among them, so that they are all shown at the same instant.
  void lagAtLeast(double lag) { least_ = lag; }

  /// The simulated clock skipped so many seconds.
  void skip(double seconds);
  /// Forgets all samples.
  void restart();

  /// True when this stream has been shown beyond what was known of it.
  bool overran() const { return overran_; }
  /// The lag now [s].
  double lag() const;
  /// By how much the needed lag exceeded the delay [s] during the last 2.5 to 5 seconds; 0 when it did not. The value
  /// is always 0 with the option `automatic`.
  double excess() const;
  /// Returns the time between the last two stamps [s], or 0 if there are fewer than two. A stream needs a lag of two
  /// intervals even if its messages arrive without any delay.
  double interval() const { return count_ > 1 ? last_ - previous_ : 0.0; }

private:
  bool fixed() const { return options_.delay == 0.0 && !options_.automatic; }
  double required() const { return peak_ > older_peak_ ? peak_ : older_peak_; }
  double own() const;   // the lag that this stream needs
  double wanted() const { return fixed() ? 0.0 : least_ > own() ? least_ : own(); }
  bool ended(double time) const;
  double known() const { return count_ > 2 ? previous_ : first_; }
  void begin(double time, double lag);
  void follow(double time, double step, double lag, bool ended);
  void forgetPeaks(double time);

  static constexpr double kNever = -std::numeric_limits<double>::infinity();

  Options options_;
  int count_ = 0;                                      // number of samples of this stream, counted up to 3
  double first_ = 0.0, previous_ = 0.0, last_ = 0.0;   // [s] stamps: of the first sample, the last but one, the last
  double arrival_ = kNever;                            // [s] simulated time at which the last sample arrived
  std::optional<double> now_;                          // [s] of the last advance()
  // [s] greatest needed lag in this period and in the one before, and the start of this period
  double peak_ = kNever, older_peak_ = kNever, peaks_since_ = kNever;
  bool following_ = false, overran_ = false, jumped_ = false;
  double query_ = 0.0, rate_ = 1.0;
  double least_ = 0.0;          // [s] see lagAtLeast()
  std::optional<double> lag_;   // [s] the lag while it is constant
};

}   // namespace slender
