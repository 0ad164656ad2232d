#pragma once

#include <cstddef>
#include <vector>

#include <boost/make_shared.hpp>
#include <boost/shared_ptr.hpp>

namespace slender {

/// A message that is published as a pointer: subscribers in the same process get it without a copy. Once published it
/// is not touched, nor read, while one of them holds it (a sole subscriber may even change it); renew() then takes
/// another, and uses again what nobody holds any more.
template <typename Message>
class SharedMessage
{
public:
  /// A message that nobody else holds, to be filled anew from header to end: an older one's content is still in it.
  Message& renew()
  {
    for (std::size_t k = 1; k <= held_.size(); ++k)
    {
      const std::size_t next = (current_ + k) % held_.size();
      if (held_[next].use_count() == 1)   // only we could raise it again
      {
        current_ = next;
        return *held_[current_];
      }
    }
    if (held_.size() < kMost)
    {
      held_.push_back(boost::make_shared<Message>());
      current_ = held_.size() - 1;
    }
    else   // somebody keeps them all: leave him the oldest
    {
      current_ = (current_ + 1) % held_.size();
      held_[current_] = boost::make_shared<Message>();
    }
    return *held_[current_];
  }

  /// After renew():
  const Message& operator*() const { return *held_[current_]; }
  const Message* operator->() const { return held_[current_].get(); }
  const boost::shared_ptr<Message>& pointer() const { return held_[current_]; }

private:
  static constexpr std::size_t kMost = 8;   // beside queues of a few messages, nothing is allocated any more
  std::vector<boost::shared_ptr<Message>> held_;
  std::size_t current_ = 0;
};

}   // namespace slender
