// Inputs as they took effect, for the bag, and from it.
#include <stdexcept>

#include "slender_sim/node/guide_inputs.h"

namespace slender {
namespace {

using slender_sim::Input;

Input inputOf(std::uint8_t kind, std::size_t index, const std::string& name)
{
  Input input = makeInput(kind);
  input.index = static_cast<std::int32_t>(index);
  input.name = name;
  return input;
}

template <class Things>
auto& checked(Things& things, std::int32_t index, const std::string& what)
{
  if (index < 0 || static_cast<std::size_t>(index) >= things.size())
    throw std::runtime_error("the scene has no " + what + " " + std::to_string(index) +
                             " that its inputs move; it is not the recorded one");
  return things[static_cast<std::size_t>(index)];
}

Eigen::Vector3d vectorOf(const Input& input)
{
  if (input.values.size() != 3)
    throw std::runtime_error("its input " + std::to_string(input.number) + " is not a vector; the bag is damaged");
  return {input.values[0], input.values[1], input.values[2]};
}

}   // namespace

void GuideInputs::onTaken(InputSink sink) { sink_ = std::move(sink); }

void GuideInputs::taken(Input input) const
{
  if (sink_)
    sink_(std::move(input));
}

void GuideInputs::takenPose(std::uint8_t kind, std::size_t index, const std::string& name, double time,
                            const Pose& X_WH, int part) const
{
  if (!sink_)
    return;
  Input input = inputOf(kind, index, name);
  input.part = part;
  input.time = time;
  input.pose = toMessage(X_WH);
  sink_(std::move(input));
}

void GuideInputs::takenValues(std::uint8_t kind, std::size_t thread, const std::vector<double>& values) const
{
  Input input = inputOf(kind, thread, "");
  input.values = values;
  taken(std::move(input));
}

void GuideInputs::stopListening()
{
  subscribers_.clear();
  tf_listener_.reset();
  tf_->stop();
}

void GuideInputs::repeat(const Input& input)
{
  switch (input.kind)
  {
    case Input::POSE:
    {
      Guided& guided = checked(guided_, input.index, "grasp, body, obstacle or nozzle");
      if (!guided.buffer || !guided.buffer->push(input.time, recordedPose(input.pose)))
        throw std::runtime_error("its pose of " + input.name + " cannot be taken; the scene is not the recorded one");
      return;
    }
    case Input::FLOW:
      if (input.values.size() != 1)
        throw std::runtime_error("its input " + std::to_string(input.number) + " is no flow; the bag is damaged");
      checked(threads_, input.index, "thread").flow = input.values[0];
      return;
    case Input::BELT: checked(threads_, input.index, "thread").belt = vectorOf(input); return;
    case Input::WIND: wind_ = vectorOf(input); return;
    case Input::GUIDE_POINTS:
    case Input::GUIDE_BODY: return repeatGuide(input);
    default:
      throw std::runtime_error("its input " + std::to_string(input.number) +
                               " is of an unknown kind; replay it with the version that recorded it");
  }
}

void GuideInputs::takenPoints(int guide, double time, const Eigen::Matrix3Xd& points) const
{
  if (!sink_)
    return;
  Input input = inputOf(Input::GUIDE_POINTS, static_cast<std::size_t>(guide), guides_[guide].topic);
  input.time = time;
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    input.points.push_back(toPoint(points.col(i)));
  sink_(std::move(input));
}

void GuideInputs::repeatGuide(const Input& input)
{
  Guide& guide = checked(guides_, input.index, "guide");
  bool good = false;
  if (input.kind == Input::GUIDE_BODY)
    good = checked(guide.bodies, input.part, "body that carries a guide").push(input.time, recordedPose(input.pose));
  else if (guide.points)
    good = guide.points->push(input.time, columnsOf(input.points));
  if (!good)
    throw std::runtime_error("its guide " + input.name + " cannot be taken; the scene is not the recorded one");
}

}   // namespace slender
