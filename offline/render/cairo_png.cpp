#include "cairo_png.h"

#include <exception>
#include <string_view>

#include "offline/io/files/error.h"
#include "offline/io/files/output_file.h"

namespace alces::offline {

void write_png(cairo_surface_t* surface, const std::filesystem::path& path) {
  OutputFile file(path);
  std::exception_ptr error;  // must not pass through cairo, which is C
  struct Sink {
    OutputFile& file;
    std::exception_ptr& error;
  } sink{file, error};
  const auto write = [](void* closure, const unsigned char* data, unsigned size) {
    auto& to = *static_cast<Sink*>(closure);
    try {
      to.file.write(std::string_view(reinterpret_cast<const char*>(data), size));
      return CAIRO_STATUS_SUCCESS;
    } catch (...) {
      to.error = std::current_exception();
      return CAIRO_STATUS_WRITE_ERROR;
    }
  };
  cairo_surface_flush(surface);
  const cairo_status_t status = cairo_surface_write_to_png_stream(surface, write, &sink);
  if (error) std::rethrow_exception(error);
  if (status != CAIRO_STATUS_SUCCESS) throw OutputError(path, cairo_status_to_string(status));
  file.commit();
}

}  // namespace alces::offline
