// Guides that a bag holds: what is in it is read by a program that knows ROS.

#include "read_tracking.h"

namespace slender {

namespace {

GuideBagReader& guideBagReader()
{
  static GuideBagReader reader;
  return reader;
}

}   // namespace

void setGuideBagReader(GuideBagReader reader) { guideBagReader() = std::move(reader); }

std::optional<RecordedGuide> readBag(const YamlCursor& at, const ReadContext& context, bool bodies, double begin,
                                     const std::string& object)
{
  BagSource source;
  source.bodies = bodies;
  source.begin = begin;
  source.object = object;
  if (at.isMap())
  {
    YamlMap map(at);
    map.require("file", source.file, "Path of the bag.");
    map.get("topic", source.topic, "Topic of the messages, if the bag holds several.");
    map.get("cloth", source.object,
            "Name of the cloth in the messages. Without the key: the name of the tracked cloth.");
  }
  else
  {
    assign(source.file, at.text());
  }
  if (source.file.empty())
    return std::nullopt;
  source.file = context.resolve(source.file);
  if (!guideBagReader())
    return at.problem("needs a program that reads bags: simulate or tracking_node, built with ROS (WITH_ROS)");
  std::optional<RecordedGuide> recorded;
  if (!at.attempt([&] { recorded = guideBagReader()(source); }))
    return std::nullopt;
  context.guide_bags.push_back(source.file);
  if (!recorded->gaps.empty())
    at.warning(recorded->gaps);
  return recorded;
}

void readBagPoints(const YamlCursor& at, const ReadContext& context, double begin, const std::string& object,
                   GuideSource& source)
{
  const Eigen::Index vertices = source.config.mesh.vertices.cols();
  auto recorded = readBag(at, context, false, begin, object);
  if (!recorded || vertices == 0)
    return;
  const Eigen::Matrix3Xd& first = recorded->points.frames().front();
  if (first.cols() != vertices)
  {
    at.problem("has " + std::to_string(first.cols()) + " points, but the guide's mesh has " + std::to_string(vertices) +
               " vertices");
    return;
  }
  const bool good = at.attempt([&] {
    for (const Eigen::Matrix3Xd& frame : recorded->points.frames())
      requireCoordinates(frame);
  });
  if (!good)
    return;
  if (begin <= 0)   // else the guide stands still until then
    recorded->points.startInMotion();
  source.config.motion = FrameGuide{std::move(recorded->points)};
}

}   // namespace slender
