/* The handlers of this program's vectors. */
#ifndef HANDLERS_H
#define HANDLERS_H

#define BOARD_TICK_IRQ 29u /* as on the bench board; here only software asks for it */

void board_tick(void);
void board_link(void);
void board_serial(void);
void board_plant(void);
void board_nmi(void);

#endif
