#include "slender_sim/node/guide_timing.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace slender {
namespace {

// [s] a longer interval begins a new stream if the last sample was reached meanwhile
constexpr double kPause = 0.25;
constexpr double kSilence = 0.4;      // [s] a stream has ended when no sample came for this time
constexpr double kFewSilence = 0.1;   // [s] the same for a stream of one or two samples
// [s] a sample stamped this far ahead belongs to a planned motion, whose end is known
constexpr double kAhead = 0.05;
constexpr double kMemory = 2.5;   // [s] the greatest needed lag is remembered for one to two times this long
// ratio of lag to needed lag, so that the next sample may be a little later than the earlier ones
constexpr double kMargin = 1.1;
constexpr double kMostLag = 1.0;   // [s] greatest lag; a stream that needs more stops and goes
// [s] time in which the rate changes by 1. For a sine of 1 Hz this adds at most 0.8 of its acceleration, a quarter of a
// period out of phase with it.
constexpr double kRamp = 0.2;
constexpr double kBrake = 0.15;    // [s] the same for a stream that runs dry
constexpr double kSettle = 0.5;    // [s] time constant with which the lag approaches the wanted one
constexpr double kCatchUp = 0.1;   // greatest rate minus 1

}   // namespace

GuideTiming::GuideTiming(const Options& options) : options_(options)
{
  if (!(options.delay >= 0.0) || !(options.coast >= 0.0))
    throw std::invalid_argument("guide timing: delay is " + std::to_string(options.delay) + " s and coast " +
                                std::to_string(options.coast) + " s; both must be >= 0");
}

bool GuideTiming::sample(double stamp)
{
  const double interval = stamp - last_, ahead = now_ ? stamp - *now_ : 0.0;
  arrival_ = now_.value_or(kNever);
  // A planned motion through sparse points is sent ahead of time or evaluated far behind. It is recognised by this: at
  // least half of the interval has not passed yet.
  const bool sparse = std::max(ahead, wanted()) >= 0.5 * interval;
  const bool fresh = count_ == 0 || (following_ && !fixed() && interval > kPause && query_ >= last_ && !sparse);
  if (fresh)
  {
    first_ = previous_ = last_ = stamp;
    count_ = 1;
    following_ = overran_ = false;
    return true;
  }
  // Instants up to known() were final without this sample. Everything that was shown beyond needed a greater lag.
  if (now_)
    peak_ = std::max(peak_, *now_ - known());
  previous_ = last_;
  last_ = stamp;
  count_ = std::min(count_ + 1, 3);
  return false;
}

double GuideTiming::own() const
{
  const double needed = required();
  if (fixed())
    return 0.0;
  if (options_.automatic)
    return needed == kNever ? options_.delay : std::clamp(kMargin * needed + 0.001, 0.0, kMostLag);
  return needed > options_.delay ? std::max(options_.delay, std::min(kMargin * needed, kMostLag)) : options_.delay;
}

bool GuideTiming::ended(double time) const
{
  if (fixed() || time - arrival_ > (count_ < 3 ? kFewSilence : kSilence) || last_ > arrival_ + kAhead)
    return true;
  // While no sample was late, a missing sample is taken as the stream's end. The motion then does not depend on the
  // times at which samples arrived.
  return count_ > 2 && !options_.live && !options_.automatic && required() <= options_.delay;
}

GuideTiming::Instant GuideTiming::advance(double time)
{
  const double step = now_ ? std::max(0.0, time - *now_) : 0.0;
  now_ = time;
  forgetPeaks(time);
  Instant instant;
  if (count_ == 0)
    return instant;
  const double lag = wanted();
  const bool over = ended(time);
  jumped_ = false;
  if (!following_)
  {
    if (time - lag < first_)
      return instant;
    begin(time, lag);
    instant.began = true;
  }
  else
    follow(time, step, lag, over);
  instant.following = true;
  instant.open = !over && count_ > 1 && options_.coast == 0.0;
  instant.time = query_;
  instant.rate = rate_;
  instant.jumped = jumped_;
  return instant;
}

/// A stream whose samples came in time runs at its full rate at once. Another one starts at its first sample, at rest.
void GuideTiming::begin(double time, double lag)
{
  following_ = true;
  const bool in_time = time - lag <= known() || ended(time);
  query_ = in_time ? time - lag : first_;
  rate_ = in_time ? 1.0 : 0.0;
  lag_ = in_time ? std::optional<double>(lag) : std::nullopt;
}

void GuideTiming::follow(double time, double step, double lag, bool over)
{
  if (lag_ && *lag_ == lag && (time - lag <= known() || over))
  {
    query_ = time - lag;
    return;
  }
  if (count_ < 3 && !over)   // the slope at the first sample is not known yet, so the motion waits there
  {
    query_ = first_;
    rate_ = 0.0;
    lag_.reset();
    return;
  }
  if (count_ < 3 && rate_ == 0.0 && time - lag >= last_ + options_.coast)
  {
    query_ = time - lag;
    rate_ = 1.0;
    lag_ = lag;
    jumped_ = true;
    return;
  }
  const bool dry = query_ > known() && !over && options_.coast == 0.0;
  overran_ = overran_ || dry;
  const double behind = time - step - query_ - lag;
  const double aim = dry ? 0.0 : 1.0 + std::clamp(behind / kSettle, -1.0, kCatchUp);
  const double most = step / (dry ? kBrake : kRamp);
  const double before = rate_;
  rate_ += std::clamp(aim - rate_, -most, most);
  query_ = std::min(query_ + 0.5 * (before + rate_) * step, std::max(query_, time));
  lag_.reset();
  const double rest = last_ + options_.coast;
  const bool at_rest = over && query_ >= rest && time - lag >= rest;
  if (at_rest || (std::abs(time - query_ - lag) < 1e-9 && std::abs(rate_ - 1.0) < 1e-7))
  {
    query_ = time - lag;
    rate_ = 1.0;
    lag_ = lag;
  }
}

/// Forgets needed lags that are older than the memory. Nothing is forgotten while no samples come.
void GuideTiming::forgetPeaks(double time)
{
  if (peak_ == kNever || time - peaks_since_ <= kMemory)
    return;
  older_peak_ = peak_;
  peak_ = kNever;
  peaks_since_ = time;
}

void GuideTiming::skip(double seconds)
{
  query_ += seconds;
  peaks_since_ += seconds;
  if (now_)
    *now_ += seconds;
}

void GuideTiming::restart() { *this = GuideTiming(options_); }

double GuideTiming::lag() const { return lag_ ? *lag_ : following_ && now_ ? *now_ - query_ : wanted(); }

double GuideTiming::excess() const
{
  return options_.automatic || fixed() ? 0.0 : std::max(0.0, required() - options_.delay);
}

}   // namespace slender
