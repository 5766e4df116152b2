#include "nvm.h"

#include "regs.h"

#define BASE 0x08004000u
#define FIRST_SECTOR 1u
#define BY_WORD 2u
#define MANY 10000000u /* looks: more than a second */
#define ERRORS (FLASH_SR_OPERR | FLASH_SR_WRPERR | FLASH_SR_PGAERR | FLASH_SR_PGPERR | FLASH_SR_PGSERR)

const void *nvm_sector(uint32_t sector)
{
    return (const void *)(BASE + sector * NVM_SECTOR_BYTES);
}

static bool finished(void)
{
    for (uint32_t looks = 0; looks < MANY; looks++) {
        if ((FLASH->SR & FLASH_SR_BSY) == 0u) {
            return (FLASH->SR & ERRORS) == 0u;
        }
    }
    return false;
}

static void unlock(void)
{
    if ((FLASH->CR & FLASH_CR_LOCK) != 0u) { /* a key too many locks it until the next reset */
        FLASH->KEYR = FLASH_KEY1;
        FLASH->KEYR = FLASH_KEY2;
    }
    FLASH->SR = ERRORS | FLASH_SR_EOP;
}

/* What the data cache still has of it is not true any more. */
static void forget_cache(void)
{
    const uint32_t before = FLASH->ACR;
    FLASH->ACR = before & ~FLASH_ACR_DCEN;
    FLASH->ACR |= FLASH_ACR_DCRST;
    FLASH->ACR &= ~FLASH_ACR_DCRST;
    FLASH->ACR = before;
}

static bool end(bool good)
{
    FLASH->CR = FLASH_CR_LOCK;
    forget_cache();
    return good;
}

bool nvm_erase(uint32_t sector)
{
    unlock();
    FLASH->CR = FLASH_CR_SER | ((FIRST_SECTOR + sector) << FLASH_CR_SNB_POS) | (BY_WORD << FLASH_CR_PSIZE_POS);
    FLASH->CR |= FLASH_CR_STRT;
    return end(finished());
}

bool nvm_write(uint32_t sector, uint32_t at, const uint32_t *words, uint32_t count)
{
    volatile uint32_t *to = (volatile uint32_t *)(BASE + sector * NVM_SECTOR_BYTES + at);
    bool good = true;
    unlock();
    FLASH->CR = FLASH_CR_PG | (BY_WORD << FLASH_CR_PSIZE_POS);
    for (uint32_t i = 0; i < count && good; i++) {
        to[i] = words[i];
        good = finished();
    }
    good = end(good);
    for (uint32_t i = 0; i < count && good; i++) {
        good = to[i] == words[i];
    }
    return good;
}
