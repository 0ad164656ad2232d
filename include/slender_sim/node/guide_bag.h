#pragma once

#include "slender_sim/scene/recorded_guide.h"

namespace slender {

/// Reads a guide's motion from a bag (`guide.motion: {bag: FILE}` of a tracked cloth): of points
/// sensor_msgs/PointCloud2, as `guide/points` takes them, or slender_sim/ClothState, as nodes and `simulate --bag`
/// record it (the guide of the cloth named, if it is tracked, else the cloth itself); of bodies slender_sim/BodyStates.
/// Coordinates are taken as they are, whatever the frame; time is that of the stamps. Throws std::runtime_error "FILE:
/// reason": not a bag, no topic or several that fit, frames that differ, stamps that do not increase, numbers that are
/// not finite, a run that was reset.
RecordedGuide readGuideBag(const BagSource& source);

}   // namespace slender
