#pragma once

#include <map>
#include <string>

namespace slender::study {

/// YAML of the scenes that studies run, by name: built in, so that a study needs no files (cmake/study.cmake).
const std::map<std::string, const char*>& packageScenes();

}  // namespace slender::study
