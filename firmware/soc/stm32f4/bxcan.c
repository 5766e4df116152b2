#include "bxcan.h"

#include "board.h"
#include "clock.h"
#include "pins.h"
#include "regs.h"

#define CAN 9u /* alternate function */
#define BIT_RATE 1000000u
#define QUANTA_MAX 25u
#define QUANTA_MIN 8u
#define MANY 20000u /* looks; leaving initialisation takes 11 bits of a quiet bus */
#define MAILBOXES 3u
#define IDS_PER_FILTER 4u

static bool wait_for_init(bool wanted)
{
    for (uint32_t looks = 0; looks < MANY; looks++) {
        if (((CAN1->MSR & CAN_MSR_INAK) != 0u) == wanted) {
            return true;
        }
    }
    return false;
}

/* As many quanta a bit as divide the clock evenly; sampled at three quarters. 0: there is none. */
static uint32_t bit_timing(uint32_t bus_Hz)
{
    for (uint32_t quanta = QUANTA_MAX; quanta >= QUANTA_MIN; quanta--) {
        if (bus_Hz % (quanta * BIT_RATE) == 0u) {
            const uint32_t divider = bus_Hz / (quanta * BIT_RATE);
            const uint32_t after = quanta / 4u;
            const uint32_t before = quanta - 1u - after;
            return ((divider - 1u) << CAN_BTR_BRP_POS) | ((before - 1u) << CAN_BTR_TS1_POS) |
                   ((after - 1u) << CAN_BTR_TS2_POS) | (1u << CAN_BTR_SJW_POS);
        }
    }
    return 0u;
}

/* Lists of sixteen-bit filters, two to a register; the last identifier fills what is left. */
static void let_in(const uint16_t *ids, uint32_t count)
{
    const uint32_t filters = (count + IDS_PER_FILTER - 1u) / IDS_PER_FILTER;
    CAN1->FMR |= CAN_FMR_FINIT;
    for (uint32_t i = 0; i < filters; i++) {
        uint32_t words[2] = {0u, 0u};
        for (uint32_t k = 0; k < IDS_PER_FILTER; k++) {
            const uint32_t nth = IDS_PER_FILTER * i + k;
            const uint32_t id = ids[nth < count ? nth : count - 1u];
            words[k / 2u] |= (id << 5u) << (16u * (k % 2u));
        }
        CAN1->F[i].R1 = words[0];
        CAN1->F[i].R2 = words[1];
    }
    CAN1->FS1R = 0u;
    CAN1->FM1R = BIT(filters) - 1u;
    CAN1->FFA1R = 0u;
    CAN1->FA1R = BIT(filters) - 1u;
    CAN1->FMR &= ~CAN_FMR_FINIT;
}

bool bxcan_start(uint32_t bus_Hz, const uint16_t *ids, uint32_t count)
{
    const uint32_t timing = bit_timing(bus_Hz);
    clock_enable(&RCC->AHB1ENR, pin_clock(BOARD_CAN_RX) | pin_clock(BOARD_CAN_TX));
    clock_enable(&RCC->APB1ENR, RCC_APB1ENR_CAN1EN);
    pin_set_up(BOARD_CAN_RX, PIN_ALTERNATE, PIN_UP, CAN);
    pin_set_up(BOARD_CAN_TX, PIN_ALTERNATE, PIN_FLOATS, CAN);
    CAN1->MCR = CAN_MCR_INRQ | CAN_MCR_TXFP | CAN_MCR_ABOM | CAN_MCR_DBF;
    if (timing == 0u || !wait_for_init(true)) {
        return false;
    }
    CAN1->BTR = timing;
    let_in(ids, count);
    CAN1->MCR &= ~CAN_MCR_INRQ;
    CAN1->IER = CAN_IER_TMEIE | CAN_IER_FMPIE0 | CAN_IER_BOFIE | CAN_IER_ERRIE;
    return true; /* it joins as soon as the bus is quiet for 11 bits, whether a caller waits for that or not */
}

bool bxcan_receive(struct dcmp_frame *frame, bool *lost)
{
    if ((CAN1->RF0R & CAN_RF0R_FOVR0) != 0u) {
        CAN1->RF0R = CAN_RF0R_FOVR0;
        *lost = true;
    }
    const uint32_t fifo = CAN1->RF0R;
    if ((fifo & (3u << CAN_RF0R_FMP0_POS)) == 0u || (fifo & CAN_RF0R_RFOM0) != 0u) {
        return false; /* none, or the one before is not released yet: the interrupt comes again */
    }
    const struct can_mailbox *box = &CAN1->R[0];
    const uint32_t low = box->DLR;
    const uint32_t high = box->DHR;
    const uint32_t length = box->DTR & 0xFu;
    frame->id = (uint16_t)((box->IR >> CAN_TIR_STID_POS) & 0x7FFu);
    frame->length = (uint8_t)(length < DCMP_PAYLOAD_MAX ? length : DCMP_PAYLOAD_MAX);
    for (uint32_t i = 0; i < 4u; i++) {
        frame->data[i] = (uint8_t)((low >> (8u * i)) & 0xFFu);
        frame->data[4u + i] = (uint8_t)((high >> (8u * i)) & 0xFFu);
    }
    CAN1->RF0R = CAN_RF0R_RFOM0;
    return true;
}

static uint32_t empty_mailboxes(void)
{
    return (CAN1->TSR >> CAN_TSR_TME_POS) & 7u;
}

bool bxcan_has_room(void)
{
    return empty_mailboxes() != 0u;
}

static uint32_t word(const uint8_t *bytes)
{
    return (uint32_t)bytes[0] | ((uint32_t)bytes[1] << 8) | ((uint32_t)bytes[2] << 16) | ((uint32_t)bytes[3] << 24);
}

void bxcan_send(const struct dcmp_frame *frame)
{
    const uint32_t empty = empty_mailboxes();
    for (uint32_t i = 0; i < MAILBOXES; i++) {
        if ((empty & BIT(i)) != 0u) {
            struct can_mailbox *box = &CAN1->T[i];
            box->DTR = frame->length;
            box->DLR = word(&frame->data[0]);
            box->DHR = word(&frame->data[4]);
            box->IR = ((uint32_t)frame->id << CAN_TIR_STID_POS) | CAN_TIR_TXRQ;
            return;
        }
    }
}

bool bxcan_abandon(void)
{
    static const uint32_t abort[MAILBOXES] = {CAN_TSR_ABRQ0, CAN_TSR_ABRQ1, CAN_TSR_ABRQ2};
    const uint32_t empty = empty_mailboxes();
    for (uint32_t i = 0; i < MAILBOXES; i++) {
        if ((empty & BIT(i)) == 0u) {
            CAN1->TSR = abort[i];
        }
    }
    return empty == 7u;
}

void bxcan_sent(void)
{
    CAN1->TSR = CAN_TSR_RQCP0 | CAN_TSR_RQCP1 | CAN_TSR_RQCP2;
}

bool bxcan_is_on_bus(void)
{
    CAN1->MSR = CAN_MSR_ERRI;
    return (CAN1->ESR & CAN_ESR_BOFF) == 0u;
}
