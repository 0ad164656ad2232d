#pragma once

#include <string>

namespace slender {

/// Returns how many pictures an .mp4 file (its first track) or a .gif file holds, by its structure alone; 0 if it is
/// cut off or cannot be read.
long picturesIn(const std::string& path);

}   // namespace slender
