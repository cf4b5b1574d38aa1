#define _GNU_SOURCE
#include "mapping.h"

#include <errno.h>
#include <fcntl.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "alces/client.h"

void mapping_drop(struct mapping* mapping) {
  if (mapping->page == NULL) return;
  union {
    const struct alces_page* constant;
    void* plain;
  } address = {mapping->page};
  munmap(address.plain, sizeof(struct alces_page));
  mapping->page = NULL;
}

static int check(const struct alces_page_head* head) {
  if (memcmp(head->magic, ALCES_PAGE_MAGIC, sizeof head->magic) != 0) return ALCES_BAD_PAGE;
  if (head->version != ALCES_PAGE_VERSION) return ALCES_OTHER_VERSION;
  return head->size == sizeof(struct alces_page) && head->start_id != 0 ? ALCES_OK : ALCES_BAD_PAGE;
}

// A file that is too short is never touched: that would be a SIGBUS. Once it is mapped nobody shortens it but
// its owner, alcesd, which never does; the head is read through the file, so that any file may be looked at.
static int look_into(struct mapping* mapping, int file, const struct stat* status) {
  struct alces_page_head head;
  if (!S_ISREG(status->st_mode) || pread(file, &head, sizeof head, 0) != (ssize_t)sizeof head)
    return ALCES_BAD_PAGE;
  const int checked = check(&head);
  if (checked != ALCES_OK) return checked;
  if (status->st_size < (off_t)sizeof(struct alces_page)) return ALCES_BAD_PAGE;
  void* const address = mmap(NULL, sizeof(struct alces_page), PROT_READ, MAP_SHARED | MAP_POPULATE, file, 0);
  if (address == MAP_FAILED) return ALCES_NO_PAGE;
  mapping_drop(mapping);
  mapping->page = address;
  mapping->device = status->st_dev;
  mapping->inode = status->st_ino;
  return ALCES_OK;
}

int mapping_look(struct mapping* mapping, const char* path) {
  const int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY);
  if (file < 0) return errno == EACCES || errno == EPERM ? ALCES_NO_PERMISSION : ALCES_NO_PAGE;
  struct stat status;
  int result = ALCES_BAD_PAGE;
  if (fstat(file, &status) == 0) {
    const int is_same =
        mapping->page != NULL && status.st_dev == mapping->device && status.st_ino == mapping->inode;
    result = is_same ? ALCES_OK : look_into(mapping, file, &status);
  }
  close(file);
  return result;
}
