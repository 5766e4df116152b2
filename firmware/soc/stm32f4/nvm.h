/* Flash memory that the firmware writes: sectors 1 and 2, 16 KiB each. */
#ifndef NVM_H
#define NVM_H

#include <stdbool.h>
#include <stdint.h>

#define NVM_SECTOR_BYTES 16384u

/* Sector 0 or 1 of the two, as it reads. */
const void *nvm_sector(uint32_t sector);

/* Blank it. The processor stands still for up to half a second: not while anything is armed, nor with the watchdog
 * running. False if the memory says that it failed. */
bool nvm_erase(uint32_t sector);

/* Write words to a blank place, `at` bytes into a sector. */
bool nvm_write(uint32_t sector, uint32_t at, const uint32_t *words, uint32_t count);

#endif
