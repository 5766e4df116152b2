/* The handlers of this board's vectors. */
#ifndef BOARD_H
#define BOARD_H

void board_tick(void);
void board_link(void);
void board_serial(void);
void board_can_sent(void);
void board_can_received(void);
void board_can_error(void);
void board_nmi(void);

#endif
