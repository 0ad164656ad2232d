#pragma once

#include <iosfwd>
#include <string>

#include "slender_sim/study/study.h"

namespace slender::study {

/// Double-quoted gnuplot string.
std::string gnuplotString(const std::string& text);

/// A gnuplot script that draws the picture into a PNG file.
void writeSurfaceScript(std::ostream& out, const SurfacePicture& picture, const std::string& png);

}   // namespace slender::study
