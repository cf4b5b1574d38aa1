// The file of the shared page (alces/page.h): made anew at each start, named when it is whole, marked as
// ended when alcesd ends.
#pragma once

#include <string>

#include "alces/page.h"
#include "alces_platform/linux/file_descriptor.h"
#include "alces_platform/settings/vehicle_settings.h"

namespace alces::onboard {

class PageFile {
 public:
  /// Makes it, and takes the place of the one before, whose readers are told. Error: a group that there is
  /// not, a file that is no page, a page that another alcesd writes, a folder on a disk (a store into the
  /// page would wait for it), or whatever the system says.
  explicit PageFile(const settings::PageSettings& settings);
  PageFile(const PageFile&) = delete;
  PageFile& operator=(const PageFile&) = delete;
  ~PageFile();

  [[nodiscard]] alces_page& page() { return *page_; }
  /// Readers are told that nothing more comes. The file stays: it says how it ended.
  void end();

 private:
  FileDescriptor file_;  ///< locked as long as it is written
  alces_page* page_ = nullptr;
};

}  // namespace alces::onboard
