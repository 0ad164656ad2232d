#pragma once

#include "slender_sim/scene/config.h"
#include "yaml_cursor.h"

namespace slender {

/// Warns of keys of a sound scene that do nothing beside its other keys. `map`: the whole scene, from which `scene` was
/// read.
void warnOfIgnoredKeys(YamlMap& map, const SceneConfig& scene);

}   // namespace slender
