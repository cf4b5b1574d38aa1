// A drawn cairo surface as a PNG file, whole or not at all.
#pragma once

#include <cairo.h>

#include <filesystem>

namespace alces::offline {

/// OutputError when it cannot be written.
void write_png(cairo_surface_t* surface, const std::filesystem::path& path);

}  // namespace alces::offline
