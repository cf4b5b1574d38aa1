// The page's file, mapped: looked for, checked, and changed for a newer one.
#ifndef ALCES_CLIENT_MAPPING_H
#define ALCES_CLIENT_MAPPING_H

#include <sys/types.h>

#include "alces/page.h"

struct mapping {
  const struct alces_page* page;  // null: none
  dev_t device;
  ino_t inode;
};

// Maps the file's page in place of the one that is mapped, unless it is the same. Not OK: why there is none,
// and what was mapped stays.
int mapping_look(struct mapping* mapping, const char* path);
void mapping_drop(struct mapping* mapping);

#endif
