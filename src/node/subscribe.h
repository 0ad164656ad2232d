#pragma once

#include <string>

#include <boost/function.hpp>
#include <ros/node_handle.h>

namespace slender {

/// Subscribes callback(message) to a topic, without the delay of small packets.
template <class Message, class Callback>
ros::Subscriber subscribe(ros::NodeHandle& nh, const std::string& topic, std::uint32_t queue_size, Callback callback)
{
  return nh.subscribe<const Message&>(topic, queue_size, boost::function<void(const Message&)>(callback),
                                      ros::VoidConstPtr(), ros::TransportHints().tcpNoDelay());
}

}   // namespace slender
