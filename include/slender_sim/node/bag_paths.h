#pragma once

#include <string>

namespace slender {

/// Returns the path to which an existing bag at `path` is renamed when a new bag replaces it: run.previous.bag for
/// run.bag.
std::string previousBag(const std::string& path);

/// Throws std::runtime_error if recording to `path` would replace the bag `read`. This is the case if both are the same
/// file (also through symbolic or hard links), or if `read` is PATH.active or previousBag(path). The message names the
/// `reader` of the bag, for example "~replay".
void requireOtherBag(const std::string& path, const std::string& read, const std::string& reader);

}   // namespace slender
