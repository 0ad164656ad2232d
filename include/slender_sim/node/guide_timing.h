#pragma once

#include <limits>
#include <optional>

namespace slender {

/// Decides which instant of a stream of stamped samples is shown at each simulated time.
///
/// Method. The instant is the simulated time minus a lag. A segment between two samples is final once the sample after it has arrived, because its
/// slope needs that sample. A stream therefore needs a lag of two intervals plus the transport, which is measured as each sample arrives. While
/// that is at most the delay that was asked for, the lag is the delay, exactly, and does not depend on when samples arrive. Where samples come
/// later, the lag grows to what they need, and shrinks again some seconds after they come in time. It changes smoothly: the rate at which instants
/// pass (1 while the lag is constant) is continuous, changes by at most 1 within 0.2 s, and exceeds 1 by at most 10 %. The motion
/// then runs through the same places, a little slower or faster, and never jerks. With a delay of its own choice (automatic) the lag is always what
/// the stream needs, plus 10 % and 1 ms.
///
/// When a live stream runs dry, the rate falls to zero within 0.15 s; the caller extrapolates meanwhile (Instant::open). After 0.4 s without a sample the
/// stream counts as ended (0.1 s while it has only two samples). A sample after a pause of more than 0.25 s, in which the last one was reached, begins a new stream.
class GuideTiming
{
public:
  struct Options
  {
    double delay = 0.05;      ///< [s] >= 0, the lag while samples come in time; 0: there is never a lag, whatever jerks that costs
    bool automatic = false;   ///< the lag follows what the stream needs; `delay` only until that is known
    bool live = false;        ///< samples come in real time: one that is missing may only be late, even if none was late before
    double coast = 0.0;       ///< [s] >= 0 for which the caller moves on after the last sample; then the rate does not fall when samples are missing
  };

  /// Throws std::invalid_argument when the delay or the coasting time is negative or not a number.
  explicit GuideTiming(const Options& options);

  /// A sample with this stamp [s] has arrived. Stamps must increase. Returns true when it begins a new stream.
  bool sample(double stamp);

  struct Instant
  {
    bool following = false;   ///< the stream has taken effect; else the rest means nothing
    bool began = false;       ///< the stream takes effect now
    bool jumped = false;      ///< the instant is another one than before, not later: two samples alone were waited with, and are a step rather than a motion
    bool open = false;        ///< the stream goes on: after its last sample the motion is unknown rather than at rest
    double time = 0.0;        ///< [s] of the samples' stamps; never decreases within a stream
    double rate = 1.0;        ///< d(instant)/d(simulated time), >= 0
  };
  /// Moves on to simulated `time` [s], which does not decrease.
  Instant advance(double time);

  /// The simulated clock skipped so many seconds.
  void skip(double seconds);
  /// Forgets all samples.
  void restart();

  /// True when this stream has been shown beyond what was known of it.
  bool overran() const { return overran_; }
  /// The lag now [s].
  double lag() const;
  /// By how much the stream needed more than the delay [s] during its last 2.5 to 5 seconds; 0 when it did not. Always 0 when automatic.
  double excess() const;

private:
  bool fixed() const { return options_.delay == 0.0 && !options_.automatic; }
  double required() const { return peak_ > older_peak_ ? peak_ : older_peak_; }
  double wanted() const;
  bool ended(double time) const;
  double known() const { return count_ > 2 ? previous_ : first_; }
  void begin(double time, double lag);
  void follow(double time, double step, double lag, bool ended);
  void forgetPeaks(double time);

  static constexpr double kNever = -std::numeric_limits<double>::infinity();

  Options options_;
  int count_ = 0;                                  // samples of this stream, as far as it matters: up to 3
  double first_ = 0.0, previous_ = 0.0, last_ = 0.0;   // [s] stamps: of the first sample, the last but one, the last
  double arrival_ = kNever;                        // [s] simulated time at which the last sample arrived
  std::optional<double> now_;                      // [s] of the last advance()
  double peak_ = kNever, older_peak_ = kNever, peaks_since_ = kNever;   // [s] greatest lag needed, in this and in the last stretch of time
  bool following_ = false, overran_ = false, jumped_ = false;
  double query_ = 0.0, rate_ = 1.0;
  std::optional<double> lag_;                      // [s] in force, while it is constant
};

}  // namespace slender
