#pragma once

#include <map>
#include <string>

namespace slender::study {

/// The scenes that studies run and what they refer to, by their paths in `config`: built in, so that a study needs no
/// files (cmake/study.cmake).
const std::map<std::string, const char*>& packageFiles();

}   // namespace slender::study
