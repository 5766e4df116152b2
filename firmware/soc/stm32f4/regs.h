/* The registers of the STM32F405 that this firmware touches, and no others. Names and bits as in RM0090;
 * tests/target/test_registers.py holds them against the vendor's own description. */
#ifndef REGS_H
#define REGS_H

#include <stdint.h>

#define BIT(n) (1u << (n))

/* ------------------------------------------------------------------------- reset and clock control */

struct rcc {
    volatile uint32_t CR, PLLCFGR, CFGR, CIR;
    volatile uint32_t AHB1RSTR, AHB2RSTR, AHB3RSTR, reserved_1C, APB1RSTR, APB2RSTR, reserved_28[2];
    volatile uint32_t AHB1ENR, AHB2ENR, AHB3ENR, reserved_3C, APB1ENR, APB2ENR, reserved_48[2];
    volatile uint32_t AHB1LPENR, AHB2LPENR, AHB3LPENR, reserved_5C, APB1LPENR, APB2LPENR, reserved_68[2];
    volatile uint32_t BDCR, CSR;
};
#define RCC ((struct rcc *)0x40023800u)

#define RCC_CR_HSEON BIT(16)
#define RCC_CR_HSERDY BIT(17)
#define RCC_CR_CSSON BIT(19)
#define RCC_CR_PLLON BIT(24)
#define RCC_CR_PLLRDY BIT(25)
#define RCC_PLLCFGR_PLLM_POS 0u
#define RCC_PLLCFGR_PLLN_POS 6u
#define RCC_PLLCFGR_PLLP_POS 16u
#define RCC_PLLCFGR_PLLSRC BIT(22)
#define RCC_PLLCFGR_PLLQ_POS 24u
#define RCC_CFGR_SW_POS 0u
#define RCC_CFGR_SWS_POS 2u
#define RCC_CFGR_PPRE1_POS 10u
#define RCC_CFGR_PPRE2_POS 13u
#define RCC_CIR_CSSF BIT(7)
#define RCC_CIR_CSSC BIT(23)
#define RCC_AHB1ENR_GPIOAEN BIT(0)
#define RCC_APB1ENR_TIM2EN BIT(0)
#define RCC_APB1ENR_TIM3EN BIT(1)
#define RCC_APB1ENR_TIM5EN BIT(3)
#define RCC_APB1ENR_USART2EN BIT(17)
#define RCC_APB1ENR_CAN1EN BIT(25)
#define RCC_APB1ENR_PWREN BIT(28)
#define RCC_APB1ENR_DACEN BIT(29)
#define RCC_APB2ENR_TIM1EN BIT(0)
#define RCC_APB2ENR_USART1EN BIT(4)
#define RCC_CSR_RMVF BIT(24)
#define RCC_CSR_BORRSTF BIT(25)
#define RCC_CSR_PADRSTF BIT(26)
#define RCC_CSR_PORRSTF BIT(27)
#define RCC_CSR_SFTRSTF BIT(28)
#define RCC_CSR_WDGRSTF BIT(29)
#define RCC_CSR_WWDGRSTF BIT(30)

/* ------------------------------------------------------------------------------------ power, flash */

struct pwr {
    volatile uint32_t CR, CSR;
};
#define PWR ((struct pwr *)0x40007000u)
#define PWR_CR_VOS BIT(14)

struct flash {
    volatile uint32_t ACR, KEYR, OPTKEYR, SR, CR, OPTCR;
};
#define FLASH ((struct flash *)0x40023C00u)

#define FLASH_ACR_LATENCY_POS 0u
#define FLASH_ACR_PRFTEN BIT(8)
#define FLASH_ACR_ICEN BIT(9)
#define FLASH_ACR_DCEN BIT(10)
#define FLASH_ACR_DCRST BIT(12)
#define FLASH_KEY1 0x45670123u
#define FLASH_KEY2 0xCDEF89ABu
#define FLASH_SR_EOP BIT(0)
#define FLASH_SR_OPERR BIT(1)
#define FLASH_SR_WRPERR BIT(4)
#define FLASH_SR_PGAERR BIT(5)
#define FLASH_SR_PGPERR BIT(6)
#define FLASH_SR_PGSERR BIT(7)
#define FLASH_SR_BSY BIT(16)
#define FLASH_CR_PG BIT(0)
#define FLASH_CR_SER BIT(1)
#define FLASH_CR_SNB_POS 3u
#define FLASH_CR_PSIZE_POS 8u
#define FLASH_CR_STRT BIT(16)
#define FLASH_CR_LOCK BIT(31)

/* -------------------------------------------------------------------------------------------- pins */

struct gpio {
    volatile uint32_t MODER, OTYPER, OSPEEDR, PUPDR, IDR, ODR, BSRR, LCKR, AFRL, AFRH;
};
#define GPIOA ((struct gpio *)0x40020000u)
#define GPIOB ((struct gpio *)0x40020400u)
#define GPIOC ((struct gpio *)0x40020800u)
#define GPIOD ((struct gpio *)0x40020C00u)
#define GPIOE ((struct gpio *)0x40021000u)
#define GPIOF ((struct gpio *)0x40021400u)
#define GPIOG ((struct gpio *)0x40021800u)

/* ------------------------------------------------------------------------------------------ timers */

struct timer {
    volatile uint32_t CR1, CR2, SMCR, DIER, SR, EGR, CCMR1, CCMR2, CCER, CNT, PSC, ARR;
    volatile uint32_t RCR, CCR1, CCR2, CCR3, CCR4, BDTR, DCR, DMAR, OR;
};
#define TIM1 ((struct timer *)0x40010000u)
#define TIM2 ((struct timer *)0x40000000u)
#define TIM3 ((struct timer *)0x40000400u)
#define TIM5 ((struct timer *)0x40000C00u)

#define TIM_CR1_CEN BIT(0)
#define TIM_CR1_URS BIT(2)
#define TIM_CR1_DIR BIT(4)
#define TIM_CR1_ARPE BIT(7)
#define TIM_CR2_MMS_POS 4u
#define TIM_CR2_MMS_UPDATE 2u
#define TIM_CR2_MMS_CAPTURE 3u /* a pulse whenever CC1IF is to be set */
#define TIM_SMCR_SMS_POS 0u
#define TIM_SMCR_SMS_ENCODER 3u /* both edges of both inputs */
#define TIM_SMCR_TS_POS 4u
#define TIM_SMCR_TS_ITR0 0u
#define TIM_SMCR_TS_ITR2 2u
#define TIM_DIER_UIE BIT(0)
#define TIM_SR_ALL 0x1E5Fu /* flags of a general-purpose timer: written 0 to clear one, 1 to leave it */
#define TIM1_SR_ALL 0x1EFFu
#define TIM_SR_UIF BIT(0)
#define TIM_SR_CC1IF BIT(1)
#define TIM_SR_BIF BIT(7)
#define TIM_EGR_UG BIT(0)
#define TIM_CCMR_S_OWN 1u /* capture what is on the channel's own input */
#define TIM_CCMR_S_TRC 3u /* capture on the internal trigger */
#define TIM_CCMR1_CC1S_POS 0u
#define TIM_CCMR1_OC1PE BIT(3)
#define TIM_CCMR1_OC1M_POS 4u
#define TIM_CCMR1_OC1M_PWM1 6u
#define TIM_CCMR1_IC1F_POS 4u
#define TIM_CCMR1_CC2S_POS 8u
#define TIM_CCMR1_IC2F_POS 12u
#define TIM_CCMR2_CC3S_POS 0u
#define TIM_CCER_CC1E BIT(0)
#define TIM_CCER_CC3E BIT(8)
#define TIM_BDTR_LOCK_POS 8u
#define TIM_BDTR_OSSI BIT(10)
#define TIM_BDTR_OSSR BIT(11)
#define TIM_BDTR_BKE BIT(12)
#define TIM_BDTR_MOE BIT(15)

/* --------------------------------------------------------------------------------------------- DAC */

struct dac {
    volatile uint32_t CR, SWTRIGR, DHR12R1;
};
#define DAC ((struct dac *)0x40007400u)
#define DAC_CR_EN1 BIT(0)

/* ------------------------------------------------------------------------------------------- USART */

struct usart {
    volatile uint32_t SR, DR, BRR, CR1, CR2, CR3, GTPR;
};
#define USART1 ((struct usart *)0x40011000u)
#define USART2 ((struct usart *)0x40004400u)

#define USART_SR_FE BIT(1)
#define USART_SR_NF BIT(2)
#define USART_SR_ORE BIT(3)
#define USART_SR_RXNE BIT(5)
#define USART_SR_TXE BIT(7)
#define USART_CR1_RE BIT(2)
#define USART_CR1_TE BIT(3)
#define USART_CR1_RXNEIE BIT(5)
#define USART_CR1_TXEIE BIT(7)
#define USART_CR1_UE BIT(13)

/* ------------------------------------------------------------------------------------------- bxCAN */

struct can_mailbox { /* the same for transmission (TI, TDT, TDL, TDH) and reception (RI, RDT, RDL, RDH) */
    volatile uint32_t IR, DTR, DLR, DHR;
};

struct can_filter {
    volatile uint32_t R1, R2;
};

struct can {
    volatile uint32_t MCR, MSR, TSR, RF0R, RF1R, IER, ESR, BTR, reserved_020[88];
    struct can_mailbox T[3];
    struct can_mailbox R[2];
    volatile uint32_t reserved_1D0[12], FMR, FM1R, reserved_208, FS1R, reserved_210, FFA1R, reserved_218, FA1R;
    volatile uint32_t reserved_220[8];
    struct can_filter F[28];
};
#define CAN1 ((struct can *)0x40006400u)

#define CAN_MCR_INRQ BIT(0)
#define CAN_MCR_TXFP BIT(2)
#define CAN_MCR_ABOM BIT(6)
#define CAN_MCR_DBF BIT(16)
#define CAN_MSR_INAK BIT(0)
#define CAN_MSR_ERRI BIT(2)
#define CAN_TSR_RQCP0 BIT(0)
#define CAN_TSR_ABRQ0 BIT(7)
#define CAN_TSR_RQCP1 BIT(8)
#define CAN_TSR_ABRQ1 BIT(15)
#define CAN_TSR_RQCP2 BIT(16)
#define CAN_TSR_ABRQ2 BIT(23)
#define CAN_TSR_TME_POS 26u
#define CAN_RF0R_FMP0_POS 0u
#define CAN_RF0R_FOVR0 BIT(4)
#define CAN_RF0R_RFOM0 BIT(5)
#define CAN_IER_TMEIE BIT(0)
#define CAN_IER_FMPIE0 BIT(1)
#define CAN_IER_BOFIE BIT(10)
#define CAN_IER_ERRIE BIT(15)
#define CAN_ESR_BOFF BIT(2)
#define CAN_BTR_BRP_POS 0u
#define CAN_BTR_TS1_POS 16u
#define CAN_BTR_TS2_POS 20u
#define CAN_BTR_SJW_POS 24u
#define CAN_TIR_TXRQ BIT(0)
#define CAN_TIR_STID_POS 21u
#define CAN_FMR_FINIT BIT(0)

/* ---------------------------------------------------------------------------- independent watchdog */

struct iwdg {
    volatile uint32_t KR, PR, RLR, SR;
};
#define IWDG ((struct iwdg *)0x40003000u)
#define IWDG_KEY_START 0xCCCCu
#define IWDG_KEY_FEED 0xAAAAu
#define IWDG_KEY_WRITE 0x5555u
#define IWDG_SR_PVU BIT(0)
#define IWDG_SR_RVU BIT(1)

/* ---------------------------------------------------------------------------------- the core's own */

struct nvic {
    volatile uint32_t ISER[8], reserved_020[24], ICER[8], reserved_0A0[24], ISPR[8], reserved_120[24], ICPR[8];
    volatile uint32_t reserved_1A0[24], IABR[8], reserved_220[56];
    volatile uint8_t IPR[240];
};
#define NVIC ((struct nvic *)0xE000E100u)

struct scb {
    volatile uint32_t CPUID, ICSR, VTOR, AIRCR, SCR, CCR, SHPR1, SHPR2, SHPR3, SHCSR, CFSR, HFSR;
};
#define SCB ((struct scb *)0xE000ED00u)
#define SCB_AIRCR_KEY (0x05FAu << 16)
#define SCB_AIRCR_SYSRESETREQ BIT(2)

struct systick {
    volatile uint32_t CTRL, LOAD, VAL, CALIB;
};
#define SYSTICK ((struct systick *)0xE000E010u)
#define SYSTICK_CTRL_ENABLE BIT(0)
#define SYSTICK_CTRL_CLKSOURCE BIT(2)
#define SYSTICK_CTRL_COUNTFLAG BIT(16)

#endif
