#pragma once

#include <string>

namespace slender {

/// Where the bag that stands at `path` is kept when a new one takes its place: run.bag becomes run.previous.bag.
std::string previousBag(const std::string& path);

/// Throws std::runtime_error when a bag that is recorded under `path` would replace the bag `read` in any way: both are
/// the same file (through symbolic or hard links, too), or `read` is PATH.active or the previous bag of `path`.
/// `reader`: who reads it, for the message, e.g. "~replay".
void requireOtherBag(const std::string& path, const std::string& read, const std::string& reader);

}   // namespace slender
